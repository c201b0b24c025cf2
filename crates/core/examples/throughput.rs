use std::time::Instant;
use pliant::scene::Scene;
use pliant::assembly::UnstableStep;
fn main() {
    for (cells, mat) in [("64, 16, 16", "stable-neo-hookean-log"), ("64, 16, 16", "stable-neo-hookean"), ("64, 16, 16", "corotated"), ("64, 16, 16", "neo-hookean"),("64,16,16","stvk"), ("160, 32, 32", "stable-neo-hookean-log")] {
        let text = format!("dimension = 3\n[time]\nintegrator = 'symplectic-euler'\nstep = 1e-6\nduration = 1.0\n[world]\ngravity=[0.0,0.0,-9.81]\n[[body]]\nmesh = {{ grid = {{ cells = [{cells}], size = [0.4, 0.1, 0.1] }} }}\nelastic = {{ {mat} = {{ young = 5e5, poisson = 0.4 }} }}\nmass = {{ density = 1000.0 }}\npin = [{{ half_space = {{ normal = [1.0, 0.0, 0.0], offset = 0.0 }} }}]\n");
        let t = Instant::now();
        let scene = Scene::from_toml(&text).unwrap();
        let mut a = match scene.assemble(UnstableStep::Accept) { Ok(a) => a, Err(p) => panic!("{p:?}") };
        let ta = t.elapsed().as_secs_f64();
        let n = a.report.bodies[0].elements;
        let x = a.simulation.state_mut().x_mut();
        for i in 0..x.len() { x[i] *= 1.0 + 0.01 * ((i as f64) * 12.9898).sin(); }
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let reps = 6_000_000 / n;
            let mut best = f64::MAX;
            pool.install(|| for _ in 0..5 { let t = Instant::now(); for _ in 0..reps { a.simulation.step().unwrap(); } best = best.min(t.elapsed().as_secs_f64() / reps as f64); });
            println!("{mat} {n} tets {threads}T: {:.1} M tets/s (assembly {ta:.2} s, {} B/tet)", n as f64 / best / 1e6, a.report.bytes / n);
        }
    }
}
