//! Scenes with known answers, for tests.

/// A beam of 4 m x 1 m, clamped at one end, that falls for a second (`error.md`, section 5).
pub(crate) const FALLING_BEAM: &str = "dimension = 2
    time = { integrator = 'velocity-verlet', step = 0.001, duration = 1.0 }
    world = { gravity = [0.0, -9.81] }
    [[body]]
    mesh = { grid = { cells = [8, 2], size = [4.0, 1.0] } }
    elastic = { neo-hookean = { young = 1e6, poisson = 0.3 } }
    mass = { density = 1000.0 }
    pin = [{ name = 'left', half_space = { normal = [1.0, 0.0], offset = 0.0 } }]
    [[probe]]
    name = 'tip'
    at = [4.0, 0.5]";

/// Lame's thick cylinder, a quarter in plane strain under inner pressure 1.
pub(crate) const CYLINDER: &str = "dimension = 2
    time = { integrator = 'quasi-static', step = 1.0, duration = 1.0 }
    [[body]]
    mesh = { elliptic_membrane = { cells = [8, 16], inner = [1.0, 1.0], outer = [2.0, 2.0] } }
    elastic = { linear = { young = 1000.0, poisson = 0.3 } }
    mass = { density = 1.0 }
    pin = [{ group = 'bottom', axes = ['y'] }, { group = 'left', axes = ['x'] }]
    load = [{ group = 'inner', traction = ['X', 'Y'] }]
    [[probe]]
    name = 'inner'
    at = [1.0, 0.0]
    [[probe]]
    name = 'outer'
    at = [2.0, 0.0]";

/// Cook's membrane of small strains in plane stress.
pub(crate) const COOK: &str = "dimension = 2
    time = { integrator = 'quasi-static', step = 1.0, duration = 1.0 }
    [[body]]
    mesh = { cooks_membrane = { cells = [8, 8] } }
    elastic = { linear = { young = 1.0, poisson = 0.3333333333333333, plane = 'stress' } }
    mass = { density = 1.0 }
    pin = [{ group = 'left' }]
    load = [{ group = 'right', traction = ['0', '1/16'] }]
    [[probe]]
    name = 'middle'
    at = [48.0, 52.0]";
