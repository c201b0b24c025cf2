// The nine steps of the lecture as data. Texts are pairs of English and Chinese. How to add one: a further
// entry of `STEPS`, and its number in `make.mjs`. An entry has
// - `title`, `lead`, `formulas` (notation of `formulas.js`), `theirs` (code), `oursNote`, `tries`;
// - `values` with `choices` and `sliders`: one with a `path` is set in the run, others open the scene again;
// - `scene(values)`: its text; `shape(values)`: scenes of one shape have one mesh and share the run's page;
//   `kind(values)`: runs of another kind are not shown behind; `view`: the box that the picture begins with;
// - `limit`: a scene whose step is refused by a message with the largest stable one, a mark on `slider`;
// - `end(values)` [s], `speed`, `paused`: how far, how fast, and whether it waits for Continue;
// - `state(state, values, run)` and `frame(frame, values, run)`: what charts need of a message of the run;
//   `ended(run, values)`: what is kept of a run at its end;
// - `charts`: `(run, values) => chart` for `Plot`; `numbers(run, values)`: rows of a name and a text.
'use strict';

/** A number as it stands in a scene. */
const toml = value => String(Number(value.toPrecision(4)));
const seconds = ['time [s]', '时间 [s]'];
const ofRun = ['this run', '本次运行'];
const byFormula = ['formula', '公式'];

const points = (samples, name) => samples.map(sample => [sample.time, sample[name]]);
/** A curve over evenly spaced places, or evenly spaced in their logarithms. */
function curve(f, low, high, { log = false, count = 160 } = {}) {
  const at = k => (log ? low * (high / low) ** (k / count) : low + ((high - low) * k) / count);
  return Array.from({ length: count + 1 }, (_, k) => [at(k), f(at(k))]);
}

/** Lines of a run, and faintly those of the run before. */
const ownLines = (run, from, entries) =>
  entries.flatMap(([name, text, colour]) => [
    ...(run.before ? [{ points: points(run.before[from], name), colour, faint: true }] : []),
    { points: points(run[from], name), colour, name: say(text) },
  ]);

const energyEntries = [
  ['kinetic', ['kinetic', '动能'], 0],
  ['elastic', ['elastic', '弹性能'], 2],
  ['gravitational', ['gravitational', '重力势能'], 4],
  ['total', ['total', '总能量'], 1],
];
const energyChart = (run, end, names = ['kinetic', 'elastic', 'total']) => ({
  name: say(['energy [J]', '能量 [J]']),
  x: { label: say(seconds), low: 0, high: Math.max(end, run.time) },
  y: {},
  lines: ownLines(
    run,
    'states',
    energyEntries.filter(([name]) => names.includes(name)),
  ),
});
const energies = ({ time, step, energy }) => ({ time, step, gravitational: 0, ...energy });

/** Time of a scene; what is larger than the limit is refused unless the scene allows it. */
const timeTable = ({ integrator, step, duration = 10, more = '' }) => `[time]
integrator = "${integrator}"
step = ${toml(step)}
duration = ${toml(Math.max(duration, 10 * step))}
${more}`;
const allow = 'allow_unstable = true\n';
const OUTPUT = `[output]
rate = 60
channels = ["state", "energy"]
`;

/** A step by which every explicit integrator is refused, and the message names the limit. */
const HUGE_STEP = 1e6;

const STEP_SIZE = { key: 'step', name: ['step h', '步长 h'], unit: 's', log: true };
const INTEGRATORS = [
  ['forward-euler', ['forward Euler', '前向欧拉']],
  ['symplectic-euler', ['symplectic Euler', '辛欧拉']],
  ['implicit-euler', ['implicit Euler', '隐式欧拉']],
];
const integratorChoice = (...more) => ({
  key: 'integrator',
  name: ['integrator', '积分器'],
  options: [...INTEGRATORS, ...more],
});

// Steps 1 and 2: one mass on a spring.

const SPRING_VIEW = [
  [-0.1, -0.4, 0],
  [1.9, 0.4, 0],
];
const omega = ({ stiffness, mass }) => Math.sqrt(stiffness / mass);
/** Length of the spring after a time [m]. */
const lengthByFormula = (v, t) => 1 + (v.speed / omega(v)) * Math.sin(omega(v) * t);
const massOnSpring = v => `title = "A mass on a spring"
dimension = 2

${timeTable({ ...v, duration: 20 })}
[[body]]
name = "spring"
mesh = { inline = { points = [[0, 0], [1, 0]], edges = [[0, 1]] } }
springs = { stiffness = ${toml(v.stiffness)} }
mass = { per_vertex = ${toml(v.mass)} }
pin = [{ vertices = [0] }]
velocity = { per_vertex = [[0, 0], [${v.speed}, 0]] }

${OUTPUT}`;

const equationOfMotion = {
  title: ['The equation of motion', '运动方程'],
  lead: [
    'A conservative force is minus the gradient of an energy. A new model needs an energy and nothing ' +
      'else: the force follows. Here the energy is that of one spring, and its motion has a formula to ' +
      'compare with.',
    '保守力等于势能的负梯度。加入新模型时只需写出能量，力由求导得到。这里的能量是一根弹簧的弹性能，它的运动有解析解，可以直接对照。',
  ],
  formulas: [
    'M \\ddot{x} = f(x) = -\\frac{\\partial E}{\\partial x}',
    '\\dot{x} = v \\quad \\dot{v} = M^{-1} f(x)',
    'E = \\frac{1}{2} k (l - l_0)^2 \\quad x(t) = l_0 + \\frac{v_0}{\\omega} \\sin \\omega t \\quad ' +
      '\\omega = \\sqrt{\\frac{k}{m}}',
  ],
  theirs: say => `def energy(x):
    return 0.5 * k * (x - rest) ** 2

def force(x):
    return -k * (x - rest)        # ${say(['minus the gradient', '负梯度'])}

x, v = rest, 2.0
while True:
    x, v = step(x, v, h)          # ${say(['a black box', '黑箱：由当前状态到下一状态'])}`,
  oursNote: [
    'One table of a body for each energy: `springs` here, `elastic` or `bending` elsewhere. `[time]` says ' +
      'which black box steps.',
    '物体的每种能量对应一个表：这里是 `springs`，别处可以是 `elastic`、`bending`。`[time]` 指定用哪个黑箱推进。',
  ],
  values: { integrator: 'symplectic-euler', stiffness: 40, mass: 1, speed: 2, step: 0.005 },
  sliders: [
    {
      key: 'stiffness',
      name: ['stiffness k', '刚度 k'],
      unit: 'N/m',
      min: 5,
      max: 400,
      log: true,
    },
    { key: 'mass', name: ['mass m', '质量 m'], unit: 'kg', min: 0.2, max: 5, log: true },
    { ...STEP_SIZE, min: 5e-4, max: 0.1 },
  ],
  scene: massOnSpring,
  shape: () => '',
  view: () => SPRING_VIEW,
  limit: { slider: 'step', scene: v => massOnSpring({ ...v, step: HUGE_STEP }) },
  end: () => 4,
  speed: 0.5,
  state: energies,
  frame: ({ time, positions }) => ({ time, x: positions[2] }),
  charts: [
    (run, v) => ({
      name: say(['length of the spring x [m]', '弹簧长度 x [m]']),
      x: { label: say(seconds), low: 0, high: Math.max(4, run.time) },
      y: {},
      lines: [
        ...ownLines(run, 'frames', [['x', ofRun, 0]]),
        {
          points: curve(t => lengthByFormula(v, t), 0, Math.max(4, run.time)),
          colour: 1,
          dashed: true,
          name: say(byFormula),
        },
      ],
    }),
    run => energyChart(run, 4),
  ],
  numbers: (run, v) => {
    const error = Math.max(0, ...run.frames.map(({ time, x }) => Math.abs(x - lengthByFormula(v, time))));
    return [
      [['angular frequency ω', '角频率 ω'], `${sayNumber(omega(v))} rad/s`],
      [['largest distance from the formula so far', '目前与公式的最大偏差'], `${sayNumber(error)} m`],
    ];
  },
  tries: [
    {
      text: [
        'Make the spring four times stiffer. The period halves: it is 2π/ω.',
        '把刚度增大到 4 倍，周期减半，因为周期是 2π/ω。',
      ],
      set: { stiffness: 160 },
    },
    {
      text: [
        'Make the step ten times smaller. The distance from the formula shrinks by about ten: symplectic ' +
          'Euler is of first order.',
        '把步长缩小到十分之一，与公式的偏差也约缩小到十分之一：辛欧拉法是一阶方法。',
      ],
      set: { step: 5e-4 },
    },
    {
      text: [
        'Watch the energies. Kinetic and elastic energy trade; their sum stays nearly level.',
        '观察能量：动能与弹性能此消彼长，二者之和基本不变。',
      ],
    },
  ],
};

/** Factor by which one step multiplies the amplitude of an oscillation, `z = h ω`. */
const GROWTH = {
  'forward-euler': z => Math.sqrt(1 + z * z),
  'symplectic-euler': z => (z <= 2 ? 1 : z * z * 0.5 - 1 + Math.sqrt((z * z * 0.5 - 1) ** 2 - 1)),
  'implicit-euler': z => 1 / Math.sqrt(1 + z * z),
};
/**
 * Energies after a time by formula, over the first one: a line, or two bounds. They hold for amplitudes below
 * the length of the spring, beyond which it is pressed through its support and no longer linear.
 */
function energyByFormula(v, end) {
  const z = v.step * omega(v),
    most = (omega(v) / v.speed) ** 2;
  const below = e => (e < most ? e : NaN);
  const line = f => ({
    points: curve(t => below(f(t)), 0, end),
    colour: 1,
    dashed: true,
    name: say(byFormula),
  });
  if (v.integrator === 'symplectic-euler') {
    const bounds = [1 / (1 + z / 2), 1 / (1 - z / 2)];
    return z < 2
      ? bounds.map((e, k) => ({
          ...line(() => e),
          name: k ? '' : say(['bounds by formula', '公式给出的上下界']),
        }))
      : [];
  }
  return [line(t => GROWTH[v.integrator](z) ** (2 * Math.round(t / v.step)))];
}

const needsLeave = v => v.integrator === 'forward-euler' || v.leave === 'yes';

const integration = {
  title: ['Integration in time', '时间积分'],
  lead: [
    'Three ways to step, at about the same length of code. Forward Euler moves by the old velocity and ' +
      'gains energy. Symplectic Euler moves by the new one and is stable up to hω = 2. Implicit Euler ' +
      'solves for the new velocity, is stable at every step, and damps.',
    '三种推进方法，代码长度相近。前向欧拉用旧速度移动，能量不断增大。辛欧拉用新速度移动，在 hω ≤ 2 时稳定。隐式欧拉要求解新速度，任意步长都稳定，但有数值阻尼。',
  ],
  formulas: [
    text => `${text(['forward:', '前向：'])} \\quad x^{+} = x + h v \\quad v^{+} = v + h M^{-1} f(x)`,
    text => `${text(['symplectic:', '辛：'])} \\quad v^{+} = v + h M^{-1} f(x) \\quad x^{+} = x + h v^{+}`,
    text =>
      `${text(['implicit:', '隐式：'])} \\quad v^{+} = v + h M^{-1} f(x^{+}) \\quad x^{+} = x + h v^{+}`,
  ],
  theirs: say => `def forward(x, v):
    return x + h * v, v + h * force(x) / m

def symplectic(x, v):
    v = v + h * force(x) / m
    return x + h * v, v

def implicit(x, v):               # ${say(['solved for a linear force', '线性力可直接解出'])}
    v = (v + h * force(x) / m) / (1 + h * h * k / m)
    return x + h * v, v`,
  oursNote: [
    'One key chooses: `integrator`. A step above the limit is refused before the run, with the limit in ' +
      'the message; `allow_unstable = true` runs it all the same.',
    '只需改一个键 `integrator`。超过极限的步长在运行前就会被拒绝，消息中给出极限值；写上 `allow_unstable = true` 则照样运行。',
  ],
  values: { integrator: 'symplectic-euler', stiffness: 40, mass: 1, speed: 0.5, step: 0.05, leave: 'no' },
  choices: [
    integratorChoice(),
    {
      key: 'leave',
      name: ['above the limit', '超过极限时'],
      options: [
        ['no', ['refuse', '拒绝']],
        ['yes', ['run all the same', '照样运行']],
      ],
      when: v => v.integrator === 'symplectic-euler',
    },
  ],
  sliders: [{ ...STEP_SIZE, min: 2e-3, max: 0.5 }],
  scene: v => massOnSpring({ ...v, more: needsLeave(v) ? allow : '' }),
  shape: () => '',
  view: () => SPRING_VIEW,
  limit: {
    slider: 'step',
    scene: v => (v.integrator === 'symplectic-euler' ? massOnSpring({ ...v, step: HUGE_STEP }) : null),
  },
  end: () => 4,
  speed: 0.5,
  state: energies,
  frame: () => null,
  charts: [
    (run, v) => {
      const own = samples => samples.map(({ time, total }) => [time, total / samples[0].total]);
      return {
        name: say(['energy, over that of the start', '能量与初始能量之比']),
        x: { label: say(seconds), low: 0, high: Math.max(4, run.time) },
        y: { log: true },
        lines: [
          ...(run.before ? [{ points: own(run.before.states), colour: 0, faint: true }] : []),
          ...energyByFormula(v, Math.max(4, run.time)),
          { points: own(run.states), colour: 0, name: say(ofRun) },
        ],
      };
    },
    (run, v) => {
      const z = v.step * omega(v);
      return {
        name: say(['growth of the amplitude in one step', '每步振幅的放大倍数']),
        x: { label: 'h ω', low: 0, high: 3.2 },
        y: { log: true, low: 0.25, high: 8 },
        lines: INTEGRATORS.map(([name, text], k) => ({
          points: curve(GROWTH[name], 0, 3.2),
          colour: [1, 0, 2][k],
          name: say(text),
        })),
        dots: [{ points: [[z, GROWTH[v.integrator](z)]], colour: 3, name: say(['this step', '当前步长']) }],
      };
    },
  ],
  numbers: (run, v) => {
    const z = v.step * omega(v),
      last = run.states.at(-1);
    const growth = last && last.total / run.states[0].total;
    return [
      ['h ω', sayNumber(z)],
      [
        ['growth of the amplitude in one step, by formula', '每步振幅放大倍数（公式）'],
        sayNumber(GROWTH[v.integrator](z), 4),
      ],
      [['energy now, over that of the start', '当前能量与初始能量之比'], growth ? sayNumber(growth) : '–'],
    ];
  },
  tries: [
    {
      text: [
        'Choose forward Euler. After n steps the energy has grown by (1 + h²ω²)ⁿ, for every step size. The ' +
          'formula ends where the spring is pressed through its support.',
        '选择前向欧拉：无论步长多小，n 步之后能量都增长到 (1 + h²ω²)ⁿ 倍。当弹簧被压过固定端时，公式不再适用。',
      ],
      set: { integrator: 'forward-euler', step: 0.02 },
    },
    {
      text: [
        'Choose implicit Euler with a large step. It is stable, and the motion dies: numerical damping.',
        '选择隐式欧拉并用大步长：稳定，但振动逐渐消失，这就是数值阻尼。',
      ],
      set: { integrator: 'implicit-euler', step: 0.2 },
    },
    {
      text: [
        'Choose symplectic Euler and drag the step beyond its mark. Then let it run all the same.',
        '选择辛欧拉，把步长拖过标记处，看程序怎样拒绝；再选“照样运行”。',
      ],
      set: { integrator: 'symplectic-euler', step: 0.34, leave: 'no' },
    },
  ],
};

// Step 3: bodies that attract each other.

const ECCENTRICITY = 0.6;
/** Relative place of two bodies of mass 1 together after a time, from Kepler's equation. */
function keplerPlace(t) {
  let anomaly = t;
  for (let k = 0; k < 60; k++) {
    anomaly -= (anomaly - ECCENTRICITY * Math.sin(anomaly) - t) / (1 - ECCENTRICITY * Math.cos(anomaly));
  }
  return [Math.cos(anomaly) - ECCENTRICITY, Math.sqrt(1 - ECCENTRICITY ** 2) * Math.sin(anomaly)];
}
const twoBodies = `[world]
nbody = { constant = 1.0 }

[[body]]
name = "system"
mesh = { inline = { points = [[-0.12, 0.0], [0.28, 0.0]] } }
mass = { per_vertex = [0.7, 0.3] }
velocity = { per_vertex = [[0.0, -0.6], [0.0, 1.4]] }
`;
const manyBodies = v => `[world]
nbody = { constant = 1.0, softening = ${toml(v.softening)} }

[[body]]
name = "stars"
mass = { total = 1.0 }
velocity = { tangential = { speed = 0.9 } }

[body.mesh.disk]
count = ${Math.round(v.count)}
radius = 1.0
inner_radius = 0.1
thickness = 0.02
seed = 1
`;
const isTwo = v => v.system === 'two';
const relativeChange = ({ time, energy }, v, run) => {
  const { total } = energy;
  const first = run.states[0]?.total ?? total;
  return { time, total, change: Math.abs((total - first) / first) };
};

const galaxy = {
  title: ['A galaxy', '星系'],
  lead: [
    'Bodies attract each other: every pair once, equal and opposite. Softening keeps close pairs finite. ' +
      'Two bodies have an exact orbit (Kepler’s equation); many have only their energy to be judged by.',
    '天体两两相吸：每一对只算一次，作用力与反作用力大小相等、方向相反。软化长度使靠得很近的两颗星受力有限。两体问题有精确轨道（开普勒方程）；多体问题只能用能量来检验。',
  ],
  formulas: [
    'E = -\\sum_{i < j} \\frac{G m_i m_j}{r_{i j}} \\quad r_{i j} = \\sqrt{|x_i - x_j|^2 + \\eps^2}',
    'f_i = -\\sum_j \\frac{G m_i m_j (x_i - x_j)}{r_{i j}^3}',
  ],
  theirs: say => `for i in range(n):
    for j in range(i):            # ${say(['each pair once', '每对只算一次'])}
        d = x[i] - x[j]
        r = sqrt(dot(d, d) + eps ** 2)
        pull = G * m[i] * m[j] / r ** 3 * d
        f[i] -= pull              # ${say(['equal and opposite', '大小相等、方向相反'])}
        f[j] += pull
for i in range(n):
    v[i] += h * f[i] / m[i]
    x[i] += h * v[i]`,
  oursNote: [
    '`world.nbody` is the sum over all pairs. The disk of stars and its circular velocities are keys of a ' +
      'body.',
    '`world.nbody` 就是对所有星对求和。恒星盘和圆周速度都由物体的键给出。',
  ],
  values: { system: 'two', integrator: 'symplectic-euler', step: 5e-3, count: 300, softening: 0.02 },
  choices: [
    {
      key: 'system',
      name: ['bodies', '天体'],
      options: [
        ['two', ['two: an ellipse', '两个：椭圆轨道']],
        ['many', ['a disk of stars', '恒星盘']],
      ],
    },
    {
      key: 'integrator',
      name: ['integrator', '积分器'],
      options: [...INTEGRATORS.slice(0, 2), ['velocity-verlet', ['velocity Verlet', '速度 Verlet']]],
    },
  ],
  sliders: [
    { ...STEP_SIZE, min: 5e-4, max: 0.05 },
    {
      key: 'count',
      name: ['number of stars', '恒星数'],
      unit: '',
      min: 50,
      max: 2000,
      log: true,
      whole: true,
      when: v => !isTwo(v),
    },
    {
      key: 'softening',
      name: ['softening ε', '软化长度 ε'],
      unit: 'm',
      min: 5e-3,
      max: 0.2,
      log: true,
      when: v => !isTwo(v),
    },
  ],
  scene: v => `title = "${isTwo(v) ? 'An ellipse of Kepler' : 'A disk of stars'}"
dimension = ${isTwo(v) ? 2 : 3}

${timeTable({ ...v, duration: 20, more: v.integrator === 'forward-euler' ? allow : '' })}
${isTwo(v) ? twoBodies : manyBodies(v)}
${OUTPUT}`,
  kind: v => v.system,
  shape: v => (isTwo(v) ? 'two' : `many ${Math.round(v.count)}`),
  view: v =>
    isTwo(v)
      ? [
          [-1.2, -0.65, 0],
          [0.55, 0.65, 0],
        ]
      : [
          [-0.9, -0.9, -0.1],
          [0.9, 0.9, 0.1],
        ],
  end: v => (isTwo(v) ? 20 : 6),
  speed: 1,
  state: relativeChange,
  frame: ({ time, positions }, v) => {
    if (!isTwo(v)) return null;
    const [x, y] = keplerPlace(time);
    const [a, b, c, d] = positions;
    return { time, error: Math.hypot(c - a - x, d - b - y) };
  },
  charts: [
    (run, v) => ({
      name: say(['energy error, over the energy of the start', '能量误差与初始能量之比']),
      x: { label: say(seconds), low: 0, high: Math.max(isTwo(v) ? 20 : 6, run.time) },
      y: { log: true },
      lines: ownLines(run, 'states', [['change', ofRun, 0]]),
    }),
    (run, v) =>
      isTwo(v)
        ? {
            name: say(['distance from the exact orbit [m]', '与精确轨道的距离 [m]']),
            x: { label: say(seconds), low: 0, high: Math.max(20, run.time) },
            y: { log: true, low: 1e-5 },
            lines: ownLines(run, 'frames', [['error', ofRun, 1]]),
          }
        : null,
  ],
  numbers: run => {
    const worst = name => (run.states.length ? Math.max(...run.states.map(sample => sample[name])) : NaN);
    return [
      [['largest energy error so far', '目前最大的能量误差'], sayNumber(worst('change'))],
      [['energy now', '当前总能量'], `${sayNumber(run.states.at(-1)?.total ?? NaN, 5)} J`],
    ];
  },
  tries: [
    {
      text: [
        'Two bodies: replace symplectic by forward Euler. The energy error no longer returns.',
        '两体：把辛欧拉换成前向欧拉，能量误差不再回落。',
      ],
      set: { system: 'two', integrator: 'forward-euler' },
    },
    {
      text: [
        'Two bodies: velocity Verlet costs one force a step, too. Halve the step: its energy error falls ' +
          'to a quarter, that of symplectic Euler to a half.',
        '两体：速度 Verlet 每步也只算一次力。步长减半时，它的能量误差降到四分之一，而辛欧拉只降到一半。',
      ],
      set: { system: 'two', integrator: 'velocity-verlet', step: 2.5e-3 },
    },
    {
      text: [
        'A disk of stars: it contracts to a ring, and the ring breaks up into clusters.',
        '恒星盘：先收缩成环，环再碎裂成星团。',
      ],
      set: { system: 'many', integrator: 'symplectic-euler', step: 5e-3 },
    },
  ],
};

// Step 4: the cantilever of springs.

const BEAM = `mesh = { grid = { cells = [19, 3], spacing = 0.03125, origin = [0.1, 0.6] } }`;
const springBeam = v => `title = "The lecture's cantilever as a mass-spring system"
dimension = 2

${timeTable({ ...v, duration: 4 })}
[world]
gravity = [0.0, -9.8]
walls = [{ normal = [1.0, 0.0], offset = 0.1 }]

[[body]]
name = "beam"
${BEAM}
springs = { young = ${toml(v.young)} }
mass = { per_vertex = 1.0 }
damping = { mass_proportional = ${toml(v.drag)} }
pin = [{ box = { min = [0.1, 0.6], max = [0.1, 0.7] } }]

${OUTPUT}`;
const SPACING = 0.03125;
/** Sum of the stiffnesses at an inner vertex: four springs along the axes and two along a diagonal. */
const stiffnessAtVertex = young => young * SPACING * (4 + 2 * Math.SQRT2);

const springs = {
  title: ['Springs', '弹簧'],
  lead: [
    'A mesh becomes masses at its vertices and springs along its edges. The gradient has the unit vector ' +
      'of the present edge: divide by the present length l, not by the rest length.',
    '网格化为顶点上的质点和沿边的弹簧。梯度的方向是当前边的单位向量：要除以当前长度 l，而不是原长。',
  ],
  formulas: [
    'E = \\frac{1}{2} k (l - l_0)^2 \\quad l = |x_1 - x_2| \\quad k = Y l_0',
    '\\frac{\\partial E}{\\partial x_1} = k (l - l_0) \\frac{x_1 - x_2}{l}',
    'F = \\frac{x_1 - x_2}{l_0} \\quad \\Psi = \\mu (|F| - 1)^2 \\quad E = l_0 \\Psi \\quad k = \\frac{2 ' +
      '\\mu}{l_0}',
  ],
  theirs: say => `for a, b, rest in edges:
    d = x[a] - x[b]
    length = norm(d)
    pull = Y * rest * (length - rest) * d / length
    f[a] -= pull                  # ${say(['present length, not rest', '用当前长度，不是原长'])}
    f[b] += pull
for i in range(n):
    if not fixed[i]:
        v[i] += h * (f[i] / m + g)
        v[i] *= exp(-c * h)       # ${say(['damping', '阻尼'])}
        x[i] += h * v[i]`,
  oursNote: [
    '`springs` makes every edge of the mesh one spring; `pin` fixes the left column.',
    '`springs` 把网格的每条边变成一根弹簧；`pin` 固定最左边一列顶点。',
  ],
  values: { integrator: 'symplectic-euler', young: 3e7, step: 1.67e-4, drag: 0 },
  sliders: [
    {
      key: 'young',
      name: ['stiffness Y (k = Y l₀)', '刚度系数 Y（k = Y l₀）'],
      unit: 'N/m²',
      min: 3e6,
      max: 3e8,
      log: true,
      path: 'body.0.springs.young',
    },
    { ...STEP_SIZE, min: 3e-5, max: 2e-3 },
    {
      key: 'drag',
      name: ['damping c', '阻尼 c'],
      unit: '1/s',
      min: 0,
      max: 10,
      path: 'body.0.damping.mass_proportional',
    },
  ],
  scene: springBeam,
  shape: () => '',
  view: () => [
    [0, 0.25, 0],
    [0.75, 0.75, 0],
  ],
  limit: { slider: 'step', scene: v => springBeam({ ...v, step: HUGE_STEP }) },
  end: () => 2,
  speed: 0.5,
  state: energies,
  frame: ({ time, positions }, v, { first }) => ({
    time,
    fall: first.at(-1) - positions.at(-1),
  }),
  charts: [
    run => ({
      name: say(['fall of the upper right corner [m]', '右上角下落的距离 [m]']),
      x: { label: say(seconds), low: 0, high: Math.max(2, run.time) },
      y: {},
      lines: ownLines(run, 'frames', [['fall', ofRun, 0]]),
    }),
    run => energyChart(run, 2),
  ],
  numbers: (run, v) => [
    [
      ['lowest point so far', '目前的最大下落'],
      `${sayNumber(Math.max(0, ...run.frames.map(({ fall }) => fall)))} m`,
    ],
    [
      [
        'stable at any deformation up to (Gershgorin, by formula)',
        '任意变形下保证稳定的步长（Gershgorin 估计，公式）',
      ],
      sayTime(2 / Math.sqrt(2 * stiffnessAtVertex(v.young))),
    ],
    ...(run.limit
      ? [
          [
            ['largest stable step at the start, by pliant', '初始形状的最大稳定步长（pliant 计算）'],
            sayTime(run.limit),
          ],
        ]
      : []),
  ],
  tries: [
    {
      text: [
        'Drag Y while the beam swings. The mark of the step moves: four times stiffer halves it.',
        '梁摆动时拖动 Y，步长上的标记随之移动：刚度变为 4 倍，最大稳定步长减半。',
      ],
      set: { young: 1.2e8 },
    },
    {
      text: [
        'Drag the step beyond the mark. pliant refuses it, and says which step it would take.',
        '把步长拖过标记，pliant 会拒绝运行，并说明多大的步长可行。',
      ],
      set: { step: 6e-4, young: 3e7 },
    },
    {
      text: [
        'Add damping. The beam comes to rest at about half of its first fall without damping.',
        '加上阻尼，梁最终静止，下垂量约为无阻尼时第一次下落的一半。',
      ],
      set: { drag: 5, step: 1.67e-4, young: 3e7 },
    },
  ],
};

// Step 5: a square of finite elements under a given deformation.

const lame = ({ young, poisson }) => ({
  mu: young / (2 * (1 + poisson)),
  lambda: (young * poisson) / ((1 + poisson) * (1 - 2 * poisson)),
});
/** Deformation gradient `[[a, b], [c, d]]`: a shear and a stretch, then a rotation. */
function gradientOf({ stretch, shear, angle }) {
  const [cos, sin] = [Math.cos((angle * Math.PI) / 180), Math.sin((angle * Math.PI) / 180)];
  return [
    [cos * stretch, cos * shear - sin],
    [sin * stretch, sin * shear + cos],
  ];
}
/** Energy densities of the materials in plane strain [J/m³]. */
const DENSITY = {
  linear: (F, { mu, lambda }) => {
    const [[a, b], [c, d]] = F;
    const [xx, yy, xy] = [a - 1, d - 1, 0.5 * (b + c)];
    return mu * (xx * xx + yy * yy + 2 * xy * xy) + 0.5 * lambda * (xx + yy) ** 2;
  },
  stvk: (F, { mu, lambda }) => {
    const [[a, b], [c, d]] = F;
    const [xx, yy, xy] = [0.5 * (a * a + c * c - 1), 0.5 * (b * b + d * d - 1), 0.5 * (a * b + c * d)];
    return mu * (xx * xx + yy * yy + 2 * xy * xy) + 0.5 * lambda * (xx + yy) ** 2;
  },
  corotated: (F, { mu, lambda }) => {
    const [[a, b], [c, d]] = F;
    // tr S of F = R S, and |F - R|² = |F|² - 2 tr S + 2.
    const trace = Math.hypot(a + d, c - b);
    return mu * (a * a + b * b + c * c + d * d - 2 * trace + 2) + 0.5 * lambda * (trace - 2) ** 2;
  },
};
const MATERIALS = [
  ['linear', ['linear (small strain)', '线弹性（小应变）']],
  ['stvk', ['St. Venant–Kirchhoff', 'St. Venant–Kirchhoff']],
  ['corotated', ['corotated', '共旋']],
];
/** Principal stretches, the second with the sign of J. */
function principalStretches([[a, b], [c, d]]) {
  const [sum, difference] = [Math.hypot(a + d, c - b), Math.hypot(a - d, b + c)];
  return [(sum + difference) / 2, (sum - difference) / 2];
}

const deformation = {
  title: ['Deformation and materials', '变形与材料'],
  lead: [
    'Near a point, a deformation is x = F X + t. A useful energy density Ψ(F) does not change when the ' +
      'body is rotated. The square shows one F everywhere, and pliant’s energy, a dot, lies on the curve ' +
      'of the formula.',
    '在一点附近，变形可写成 x = F X + t。有用的能量密度 Ψ(F) 在物体转动时不变。图中的方块处处具有同一个 F；圆点是 pliant 算出的能量，正好落在公式曲线上。',
  ],
  formulas: [
    'E = \\frac{1}{2} (F^T F - I) \\quad \\eps = \\frac{1}{2} (F + F^T) - I \\quad F = R S',
    '\\Psi_{\\text{linear}} = \\mu |\\eps|^2 + \\frac{\\lambda}{2} \\tr(\\eps)^2',
    '\\Psi_{\\text{StVK}} = \\mu |E|^2 + \\frac{\\lambda}{2} \\tr(E)^2',
    '\\Psi_{\\text{corotated}} = \\mu |F - R|^2 + \\frac{\\lambda}{2} \\tr(S - I)^2',
    '\\mu = \\frac{E}{2 (1 + \\nu)} \\quad \\lambda = \\frac{E \\nu}{(1 + \\nu)(1 - 2 \\nu)}',
  ],
  theirs: say => `def corotated(F):
    U, sigma, V = svd(F)
    R = U @ V.T                   # ${say(['the rotation in F', 'F 中的转动'])}
    return 2 * mu * (F - R) + lam * trace(R.T @ F - I) * R

def stvk(F):
    E = 0.5 * (F.T @ F - I)       # ${say(['Green strain', 'Green 应变'])}
    return F @ (2 * mu * E + lam * trace(E) * I)`,
  oursNote: [
    'The material is one key. `position` starts the square with a given F; nothing holds it, so Continue ' +
      'lets it spring back.',
    '材料只是一个键。`position` 让方块从给定的 F 开始；没有约束，按“继续”它就会弹回去。',
  ],
  values: { material: 'corotated', stretch: 1.4, shear: 0.3, angle: 0, poisson: 0.3, young: 1e4 },
  choices: [{ key: 'material', name: ['material', '材料'], options: MATERIALS }],
  sliders: [
    { key: 'stretch', name: ['stretch', '拉伸'], unit: '', min: 0.2, max: 2 },
    { key: 'shear', name: ['shear', '剪切'], unit: '', min: -1, max: 1 },
    { key: 'angle', name: ['rotation', '转动'], unit: '°', min: 0, max: 180, digits: 3 },
    { key: 'poisson', name: ['Poisson’s ratio ν', '泊松比 ν'], unit: '', min: 0, max: 0.45 },
  ],
  scene: v => {
    const row = numbers => `[${numbers.map(value => String(Number(value.toFixed(12)))).join(', ')}]`;
    return `title = "A square under a given deformation"
dimension = 2

${timeTable({ integrator: 'implicit-midpoint', step: 2e-3 })}
[[body]]
name = "square"
mesh = { grid = { size = [1, 1], cells = [4, 4] } }
mass = { density = 1000 }
elastic = { ${v.material} = { young = ${toml(v.young)}, poisson = ${toml(v.poisson)} } }

[body.position.affine]
matrix = [${gradientOf(v).map(row).join(', ')}]

${OUTPUT}`;
  },
  shape: () => '',
  view: () => [
    [-0.5, -0.3, 0],
    [2, 1.4, 0],
  ],
  end: () => 1,
  speed: 0.2,
  paused: true,
  state: energies,
  frame: () => null,
  charts: [
    (run, v) => {
      const at = stretch => gradientOf({ ...v, stretch });
      return {
        name: say(['energy density Ψ over the stretch [J/m³]', '能量密度 Ψ 随拉伸的变化 [J/m³]']),
        x: { label: say(['stretch', '拉伸']), low: 0.2, high: 2 },
        y: { low: 0, high: Math.max(2500, 1.15 * DENSITY[v.material](gradientOf(v), lame(v))) },
        lines: MATERIALS.map(([name, text], k) => ({
          points: curve(stretch => DENSITY[name](at(stretch), lame(v)), 0.2, 2),
          colour: k,
          name: say(text),
        })),
        dots: run.states.length
          ? [{ points: [[v.stretch, run.states[0].elastic]], colour: 3, name: say(['pliant', 'pliant']) }]
          : [],
      };
    },
  ],
  numbers: (run, v) => {
    const F = gradientOf(v),
      formula = DENSITY[v.material](F, lame(v)),
      own = run.states[0]?.elastic ?? NaN,
      [[a, b], [c, d]] = F;
    return [
      ['J = det F', sayNumber(a * d - b * c)],
      [
        ['principal stretches', '主拉伸'],
        principalStretches(F)
          .map(s => sayNumber(s))
          .join(', '),
      ],
      [['Ψ by the formula', '公式给出的 Ψ'], `${sayNumber(formula, 5)} J/m³`],
      [['Ψ by pliant', 'pliant 给出的 Ψ'], `${sayNumber(own, 5)} J/m³`],
      [
        ['their relative difference', '二者的相对差'],
        sayNumber(Math.abs(own - formula) / Math.max(formula, 1e-9), 2),
      ],
    ];
  },
  tries: [
    {
      text: [
        'Rotate only: no stretch, no shear. Ψ stays zero for two materials; the linear one mistakes a ' +
          'rotation for a strain.',
        '只转动，不拉伸也不剪切：两种材料的 Ψ 为零，线弹性却把转动误当成应变。',
      ],
      set: { material: 'linear', stretch: 1, shear: 0, angle: 60 },
    },
    {
      text: [
        'Compress to 0.3. St. Venant–Kirchhoff softens: its curve flattens, and the force that resists ' +
          'falls.',
        '压缩到 0.3：St. Venant–Kirchhoff 变软，曲线变平，抵抗的力反而减小。',
      ],
      set: { material: 'stvk', stretch: 0.3, shear: 0, angle: 0, poisson: 0 },
    },
    {
      text: [
        'Press Continue. The square springs back and overshoots.',
        '按“继续”，方块弹回并越过原来的形状。',
      ],
      set: { material: 'corotated', stretch: 1.4, shear: 0.3, angle: 0, poisson: 0.3 },
    },
  ],
};

// Step 6: a beam of finite elements beside beam theory.

const STRIP = { length: 1, height: 0.1, young: 5e7, density: 1000, gravity: 9.81 };
/** Deflection of a clamped beam under its weight: bending (Euler, Bernoulli) and shear (Timoshenko). */
const deflectionByTheory = (() => {
  const { length, height, young, density, gravity } = STRIP,
    load = density * gravity * height,
    inertia = height ** 3 / 12;
  return (
    (load * length ** 4) / (8 * young * inertia) +
    (load * length ** 2) / (2 * (5 / 6) * (young / 2) * height)
  );
})();
const strip = v => `title = "A beam under its own weight"
dimension = 2

${timeTable({ integrator: 'implicit-euler', step: 0.01, duration: 1, ...v.time })}
[world]
gravity = [0.0, ${-STRIP.gravity}]

[[body]]
name = "beam"
mesh = { grid = { size = [${STRIP.length}, ${STRIP.height}], cells = [${10 * v.cells}, ${v.cells}] } }
order = ${v.order}
elastic = { corotated = { young = ${toml(STRIP.young)}, poisson = 0 } }
mass = { density = ${STRIP.density} }
damping = { mass_proportional = 30 }
pin = [{ half_space = { normal = [1, 0], offset = 0 } }]

${OUTPUT}`;

/** Mean height of the vertices at the free end. */
function endHeight(positions, first) {
  let [sum, count] = [0, 0];
  for (let k = 0; k < first.length; k += 2) {
    if (Math.abs(first[k] - STRIP.length) > 1e-6) continue;
    const y = first[k + 1];
    if (y > 1e-6 && y < STRIP.height - 1e-6) continue;
    sum += positions[k + 1];
    count++;
  }
  return sum / count;
}

const elements = {
  title: ['Linear finite elements', '线性有限元'],
  lead: [
    'A triangle has the edge matrices Dₘ at rest and Dₛ now, and so one F. Its energy is the rest area ' +
      'times Ψ(F). Linear triangles are too stiff in bending: they lock. The beam below has an answer by ' +
      'beam theory.',
    '三角形的边矩阵在参考构型中为 Dₘ，当前为 Dₛ，由此得到唯一的 F。单元的能量等于参考面积乘 Ψ(F)。线性三角形弯曲时偏硬，即“剪切闭锁”。下面的梁可以与梁理论对照。',
  ],
  formulas: [
    'F = D_s D_m^{-1} \\quad E = w \\Psi(F) \\quad P = \\frac{\\partial \\Psi}{\\partial F}',
    'H = w P D_m^{-T} \\quad f_1 = -h_1 \\quad f_2 = -h_2 \\quad f_3 = h_1 + h_2',
    'u = \\frac{q L^4}{8 E I} + \\frac{q L^2}{2 \\kappa G A} \\quad I = \\frac{b^3}{12} \\quad A = b ' +
      '\\quad \\kappa = \\frac{5}{6}',
  ],
  theirs: say => `for t, (i, j, k) in enumerate(triangles):
    Ds = columns(x[i] - x[k], x[j] - x[k])
    F = Ds @ inverse_Dm[t]
    P = first_piola(F)            # ${say(['from step 5', '见第 5 步'])}
    H = area[t] * P @ inverse_Dm[t].T
    f[i] -= H[:, 0]
    f[j] -= H[:, 1]
    f[k] += H[:, 0] + H[:, 1]     # ${say(['forces sum to zero', '合力为零'])}
for i in range(n):
    v[i] += h * (f[i] / m[i] + g)
    x[i] += h * v[i]`,
  oursNote: [
    '`elastic` makes the triangles finite elements. `order = 2` gives them nodes at mid-edges, which do ' +
      'not lock. Damping and implicit steps bring the beam to rest quickly.',
    '`elastic` 把三角形变成有限元。`order = 2` 在边中点加节点，消除闭锁。阻尼和隐式步长使梁很快静止。',
  ],
  values: { cells: 3, order: 1 },
  choices: [
    {
      key: 'order',
      name: ['elements', '单元'],
      options: [
        [1, ['linear', '线性']],
        [2, ['quadratic', '二次']],
      ],
    },
  ],
  sliders: [
    {
      key: 'cells',
      name: ['cells through the height n', '高度方向的单元数 n'],
      unit: '',
      min: 1,
      max: 8,
      whole: true,
      step: 1,
    },
  ],
  scene: strip,
  shape: v => `${v.cells} ${v.order}`,
  limit: { scene: v => strip({ ...v, time: { integrator: 'symplectic-euler', step: HUGE_STEP } }) },
  end: () => 0.6,
  speed: 0.5,
  state: energies,
  frame: ({ time, positions }, v, { first }) => ({
    time,
    fall: endHeight(first, first) - endHeight(positions, first),
  }),
  ended: (run, v) => {
    const fall = run.frames.at(-1)?.fall;
    if (fall > 0)
      run.session.set(`${v.order} ${v.cells}`, { ...v, error: Math.abs(fall / deflectionByTheory - 1) });
  },
  charts: [
    run => ({
      name: say(['deflection of the free end [m]', '自由端的挠度 [m]']),
      x: { label: say(seconds), low: 0, high: Math.max(0.6, run.time) },
      y: { low: 0 },
      lines: [
        ...ownLines(run, 'frames', [['fall', ofRun, 0]]),
        {
          points: curve(() => deflectionByTheory, 0, Math.max(0.6, run.time), { count: 1 }),
          colour: 1,
          dashed: true,
          name: say(['beam theory', '梁理论']),
        },
      ],
    }),
    run => {
      const measured = order =>
        [...run.session.values()].filter(v => v.order === order).map(v => [v.cells, v.error]);
      const error = n => 1 - 1 / (1 + 4 / (n * n));
      return {
        name: say(['relative error of the deflection, over n', '挠度的相对误差，随 n 变化']),
        x: { label: 'n', low: 0.9, high: 9, log: true, ticks: [1, 2, 3, 4, 6, 8] },
        y: { log: true, low: 3e-4, high: 1.2 },
        lines: [
          {
            points: curve(error, 0.9, 9, { log: true }),
            colour: 1,
            dashed: true,
            name: say(['estimate: 1 + 4/n² times as stiff', '估计：刚度为精确值的 1 + 4/n² 倍']),
          },
        ],
        dots: [
          { points: measured(1), colour: 0, name: say(['linear, measured', '线性（计算结果）']) },
          { points: measured(2), colour: 2, name: say(['quadratic, measured', '二次（计算结果）']) },
        ],
      };
    },
  ],
  numbers: (run, v) => {
    const fall = run.frames.at(-1)?.fall;
    return [
      [['deflection by beam theory', '梁理论的挠度'], `${sayNumber(deflectionByTheory, 4)} m`],
      [['deflection now', '当前挠度'], fall === undefined ? '–' : `${sayNumber(fall, 4)} m`],
      [['triangles', '三角形数'], String(20 * v.cells * v.cells)],
      ...(run.limit ? [['limitOfExplicit', sayTime(run.limit)]] : []),
    ];
  },
  tries: [
    {
      text: [
        'Set n = 1, 2, 4, 8 and wait for the end of each run. The dots follow the estimate.',
        '依次取 n = 1、2、4、8，等每次运行结束，圆点沿估计曲线下降。',
      ],
      set: { cells: 1, order: 1 },
    },
    {
      text: [
        'Choose quadratic elements. One row of them is closer than eight rows of linear ones.',
        '选择二次单元：一层二次单元比八层线性单元还准。',
      ],
      set: { cells: 1, order: 2 },
    },
    {
      text: [
        'Watch the largest stable step of symplectic Euler: it halves when n doubles.',
        '注意辛欧拉法的最大稳定步长：n 加倍，它就减半。',
      ],
      set: { cells: 6, order: 1 },
    },
  ],
};

// Step 7: a mirrored beam.

const CELLS = [12, 3];
/** Triangles of a cell with the corners a, b below and c, d above, as a grid is split. */
const trianglesOfCell = ([a, b, c, d]) => [
  [a, b, d],
  [a, d, c],
];
/** Areas of the triangles of a grid, over those at rest. */
function jacobians(positions) {
  const [columns, rows] = CELLS,
    values = [];
  // Vertices of a grid are numbered column by column.
  const at = (i, j) => [0, 1].map(axis => positions[2 * (i * (rows + 1) + j) + axis]);
  for (let i = 0; i < columns; i++) {
    for (let j = 0; j < rows; j++) {
      const corners = [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)];
      for (const [p, q, r] of trianglesOfCell(corners)) {
        const area = (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1]);
        values.push(area / (SPACING * SPACING));
      }
    }
  }
  return values;
}
const BODIES = {
  springs: v => `springs = { young = ${toml(v.young)} }`,
  corotated: v => `elastic = { corotated = { young = ${toml(v.young)}, poisson = 0.3 } }`,
  stvk: v => `elastic = { stvk = { young = ${toml(v.young)}, poisson = 0.3 } }`,
};

const inversion = {
  title: ['Inversion', '翻转'],
  lead: [
    'A spring knows its length and nothing else. A finite element knows its orientation: det F is negative ' +
      'when it is inverted. The beam starts mirrored, with every triangle inside out.',
    '弹簧只知道自己的长度。有限单元还知道自己的定向：翻转时 det F 为负。梁从镜像状态开始，所有三角形都处于翻转状态。',
  ],
  formulas: [
    text => `J = \\det F < 0 \\quad ${text(['inverted', '翻转'])}`,
    text => `F = R S \\quad \\det R = 1 \\quad ${text(['also where J < 0', '当 J < 0 时也成立'])}`,
    'F^T F = (Q F)^T (Q F) \\quad \\det Q = -1',
  ],
  theirs:
    say => `def rotation(F):                  # ${say(['signed polar decomposition', '带符号的极分解'])}
    U, sigma, V = svd(F)
    if det(U @ V.T) < 0:          # ${say(['no reflection allowed', '不允许反射'])}
        U[:, -1] = -U[:, -1]      # ${say(['flip the smallest stretch', '翻转最小的主拉伸'])}
        sigma[-1] = -sigma[-1]
    return U @ V.T

inverted = sum(det(F[t]) < 0 for t in range(len(triangles)))`,
  oursNote: [
    '`position` starts the beam mirrored. `ether_drag` brings it to rest.',
    '`position` 让梁从镜像状态开始，`ether_drag` 使它逐渐静止。',
  ],
  values: { material: 'corotated', young: 3e5, drag: 2 },
  choices: [
    {
      key: 'material',
      name: ['energy', '能量'],
      options: [
        ['springs', ['springs', '弹簧']],
        ['corotated', ['corotated elements', '共旋有限元']],
        ['stvk', ['St. Venant–Kirchhoff elements', 'St. Venant–Kirchhoff 有限元']],
      ],
    },
  ],
  sliders: [
    {
      key: 'young',
      name: ['Young’s modulus E, or Y', '杨氏模量 E 或 Y'],
      unit: 'Pa',
      min: 3e4,
      max: 3e6,
      log: true,
    },
    { key: 'drag', name: ['drag', '介质阻力'], unit: '1/s', min: 0, max: 10, path: 'world.ether_drag' },
  ],
  scene: v => `title = "A mirrored beam"
dimension = 2

${timeTable({ integrator: 'symplectic-euler', step: 1e-4, duration: 2 })}
[world]
gravity = [0.0, -9.8]
ether_drag = ${toml(v.drag)}

[[body]]
name = "beam"
mesh = { grid = { cells = [${CELLS.join(', ')}], spacing = ${SPACING}, origin = [0.0, 0.0] } }
${BODIES[v.material](v)}
mass = { density = 1000.0 }
pin = [{ box = { min = [0.0, 0.0], max = [0.0, 0.1] } }]
position = { affine = { matrix = [[-0.98, 0.05], [0.0, 1.0]] } }

${OUTPUT}`,
  shape: v => (v.material === 'springs' ? 'springs' : 'elements'),
  view: () => [
    [-0.45, -0.35, 0],
    [0.45, 0.3, 0],
  ],
  limit: null,
  end: () => 2,
  speed: 0.25,
  state: energies,
  frame: ({ time, positions }) => {
    const values = jacobians(positions);
    return { time, inverted: values.filter(J => J < 0).length, least: Math.min(...values) };
  },
  charts: [
    run => ({
      name: say(['inverted triangles', '翻转的三角形数']),
      x: { label: say(seconds), low: 0, high: Math.max(2, run.time) },
      y: { low: 0, high: 75 },
      lines: ownLines(run, 'frames', [['inverted', ofRun, 0]]),
    }),
    run => ({
      name: say(['smallest J', '最小的 J']),
      x: { label: say(seconds), low: 0, high: Math.max(2, run.time) },
      y: {},
      lines: [
        ...ownLines(run, 'frames', [['least', ofRun, 2]]),
        {
          points: [
            [0, 0],
            [Math.max(2, run.time), 0],
          ],
          colour: 1,
          dashed: true,
          name: 'J = 0',
        },
      ],
    }),
  ],
  numbers: run => {
    const last = run.frames.at(-1);
    return [
      [
        ['inverted triangles now', '当前翻转的三角形'],
        last ? `${last.inverted} / ${2 * CELLS[0] * CELLS[1]}` : '–',
      ],
      [['smallest J now', '当前最小的 J'], sayNumber(last?.least ?? NaN)],
    ];
  },
  tries: [
    {
      text: [
        'Corotated elements turn right side out: the count falls from 72 to 0.',
        '共旋材料的单元会翻正：翻转的三角形从 72 个降到 0 个。',
      ],
      set: { material: 'corotated', young: 3e5 },
    },
    {
      text: [
        'Springs do not notice. The beam swings below its support mirrored: most triangles stay inverted.',
        '弹簧毫无察觉：梁以镜像状态在固定端下方摆动，大部分三角形始终翻转。',
      ],
      set: { material: 'springs', young: 3e5 },
    },
    {
      text: [
        'St. Venant–Kirchhoff does not notice either: FᵀF does not know the sign of J.',
        'St. Venant–Kirchhoff 同样察觉不到：FᵀF 不含 J 的符号。',
      ],
      set: { material: 'stvk', young: 3e5 },
    },
  ],
};

// Step 8: the implicit cloth.

const solverOf = v => (v.integrator === 'symplectic-euler' ? '' : `solver = { linear = "${v.linear}" }\n`);
const clothScene = v => `title = "An implicit cloth"
dimension = 3

${timeTable({ ...v, duration: 4, more: solverOf(v) })}
[world]
gravity = [0.0, 0.0, -2.0]

[[body]]
name = "cloth"
springs = { stiffness = ${toml(v.stiffness)} }
mass = { per_vertex = 1.0 }

[body.mesh.cloth]
cells = [10, 10]
origin = [-0.25, 0.0, 0.5]
u = [0.5, 0.0, 0.0]
v = [0.0, 0.5, 0.0]

[[attachment]]
name = "corners"
body = "cloth"
vertices = [0, 110]
stiffness = 1e5

${OUTPUT}`;

const cloth = {
  title: ['An implicit cloth', '隐式布料'],
  lead: [
    'Implicit Euler solves for the velocity whose end point has the force that causes it. One Newton step ' +
      'from the old positions makes this linear: one sparse system a step, at any step size, paid for by ' +
      'damping.',
    '隐式欧拉要求新速度与终点处的力相一致。从旧位置做一步牛顿迭代，问题就成为线性的：每步解一个稀疏方程组，步长不受限制，代价是数值阻尼。',
  ],
  formulas: [
    'M (v^{+} - v) = h f(x + h v^{+}) \\quad K = -\\frac{\\partial f}{\\partial x}',
    '(M + h^2 K) v^{+} = M v + h f(x)',
    'x^{+} = x + h v^{+}',
  ],
  theirs: say => `K = zeros(3 * n, 3 * n)
for a, b, k, rest in edges:
    d = (x[a] - x[b]) / norm(x[a] - x[b])
    block = k * outer(d, d)       # ${say(['and the part across d', '以及与 d 垂直的部分'])}
    add(K, a, a, block); add(K, b, b, block)
    add(K, a, b, -block); add(K, b, a, -block)
A = M + h * h * K
v = solve(A, M @ v + h * f(x))    # ${say(['sparse Cholesky, or CG', '稀疏 Cholesky 或共轭梯度'])}
x = x + h * v`,
  oursNote: [
    '`linearised-implicit-euler` is one such solve a step; `implicit-euler` repeats it until the forces ' +
      'balance. `solver.linear` chooses Cholesky or conjugate gradients without a matrix.',
    '`linearised-implicit-euler` 每步只解一次；`implicit-euler` 反复求解直到力平衡。`solver.linear` 选择 Cholesky 或无矩阵的共轭梯度。',
  ],
  values: { integrator: 'linearised-implicit-euler', linear: 'cholesky', step: 0.01, stiffness: 1000 },
  choices: [
    {
      key: 'integrator',
      name: ['integrator', '积分器'],
      options: [
        ['linearised-implicit-euler', ['implicit Euler, one solve', '隐式欧拉，解一次']],
        ['implicit-euler', ['implicit Euler, Newton', '隐式欧拉，牛顿迭代']],
        ['symplectic-euler', ['symplectic Euler', '辛欧拉']],
      ],
    },
    {
      key: 'linear',
      name: ['linear solver', '线性求解器'],
      options: [
        ['cholesky', ['sparse Cholesky', '稀疏 Cholesky']],
        ['matrix-free', ['conjugate gradients', '共轭梯度（无矩阵）']],
      ],
      when: v => v.integrator !== 'symplectic-euler',
    },
  ],
  sliders: [
    { ...STEP_SIZE, min: 1e-3, max: 0.1 },
    {
      key: 'stiffness',
      name: ['stiffness of springs', '弹簧刚度'],
      unit: 'N/m',
      min: 100,
      max: 1e4,
      log: true,
      path: 'body.0.springs.stiffness',
    },
  ],
  scene: clothScene,
  shape: () => '',
  view: () => [
    [-0.35, -0.5, -0.1],
    [0.35, 0.5, 0.6],
  ],
  limit: {
    slider: 'step',
    name: 'limitOfExplicit',
    scene: v => clothScene({ ...v, integrator: 'symplectic-euler', step: HUGE_STEP }),
  },
  end: () => 3,
  speed: 1,
  state: energies,
  frame: ({ time, positions }) => {
    let sum = 0;
    for (let k = 2; k < positions.length; k += 3) sum += positions[k];
    return { time, height: (3 * sum) / positions.length };
  },
  charts: [
    run => energyChart(run, 3, ['kinetic', 'total']),
    run => ({
      name: say(['height of the centre of mass [m]', '质心高度 [m]']),
      x: { label: say(seconds), low: 0, high: Math.max(3, run.time) },
      y: {},
      lines: ownLines(run, 'frames', [['height', ofRun, 0]]),
    }),
  ],
  numbers: run => {
    const [first, last] = [run.states[0], run.states.at(-1)];
    return [
      [['energy lost so far', '已损失的能量'], first ? `${sayNumber(first.total - last.total)} J` : '–'],
      ...(run.limit ? [['limitOfExplicit', sayTime(run.limit)]] : []),
    ];
  },
  tries: [
    {
      text: [
        'Halve the step. The cloth swings higher, because there is less numerical damping.',
        '步长减半：布料荡得更高，因为数值阻尼更小。',
      ],
      set: { integrator: 'linearised-implicit-euler', step: 0.005 },
    },
    {
      text: [
        'Choose a step of 50 ms, far beyond the limit of symplectic Euler. It is stable, and the cloth ' +
          'swings back much less high.',
        '步长取 50 ms，远超辛欧拉的极限：仍然稳定，但荡回的高度低得多。',
      ],
      set: { integrator: 'linearised-implicit-euler', step: 0.05 },
    },
    {
      text: [
        'Choose symplectic Euler with a step below the mark. The energy stays.',
        '选择辛欧拉，步长取在标记以下：能量得以保持。',
      ],
      set: { integrator: 'symplectic-euler', step: 0.002 },
    },
  ],
};

// Step 9: a structure of one's own.

const STRUCTURES = {
  ring: v => `pin = [{ half_space = { normal = [0, -1], offset = -0.29 } }]

[body.mesh.annulus]
cells = [${v.cells}, ${12 * v.cells}]
inner_radius = 0.2
outer_radius = 0.3`,
  bridge:
    v => `mesh = { grid = { size = [1, 0.1], cells = [${10 * v.cells}, ${v.cells}], origin = [-0.5, 0] } }
pin = [
    { half_space = { normal = [1, 0], offset = -0.5 } },
    { half_space = { normal = [-1, 0], offset = -0.5 } },
]`,
  flag: v => `mesh = { grid = { size = [0.5, 0.5], cells = [${3 * v.cells}, ${3 * v.cells}] } }
pin = [{ box = { min = [0, 0.5], max = [0, 0.5] } }]`,
};
const VIEWS = {
  ring: [
    [-0.35, -0.6, 0],
    [0.35, 0.35, 0],
  ],
  bridge: [
    [-0.6, -0.4, 0],
    [0.6, 0.25, 0],
  ],
  flag: [
    [-0.5, -0.6, 0],
    [0.7, 0.6, 0],
  ],
};
const woven = v => `title = "A structure of your own"
dimension = 2

${timeTable({ integrator: 'symplectic-euler', step: v.step, duration: 2 })}
[world]
gravity = [0, -9.81]

[[body]]
name = "structure"
${BODIES[v.energy === 'springs' ? 'springs' : 'corotated'](v)}
mass = { density = 1000 }
${STRUCTURES[v.structure](v)}

${OUTPUT}`;

const weave = {
  title: ['Weave your own structure', '编织自己的结构'],
  lead: [
    'The last homework is a structure of your own, in springs or in finite elements. Choose a mesh and an ' +
      'energy here, then open the scene in the editor and change anything.',
    '最后的作业是用弹簧或有限元编织自己的结构。先在这里选网格和能量，再在编辑器中打开场景，随意修改。',
  ],
  formulas: [
    'M \\ddot{x} = -\\frac{\\partial E}{\\partial x} + M g',
    'E_{\\text{springs}} = \\sum_e \\frac{1}{2} k_e (l_e - l_{0 e})^2 \\quad E_{\\text{elements}} = ' +
      '\\sum_t w_t \\Psi(F_t)',
  ],
  theirs: say => `vertices, triangles = my_mesh()   # ${say(['any shape', '任意形状'])}
edges = {sorted_pair(a, b) for t in triangles for a, b in sides(t)}
f = gravity(m)
f += spring_forces(x, edges)      # ${say(['step 4, or', '第 4 步，或者'])}
f += element_forces(x, triangles) # ${say(['step 6', '第 6 步'])}
f[fixed] = 0
v = v + h * f / m
x = x + h * v`,
  oursNote: [
    'A mesh, an energy, a mass and a pin: four lines of a body. Meshes come from generators, as here, from ' +
      'lists of points, or from files.',
    '网格、能量、质量、固定：物体只需四行。网格可以像这里一样由生成器给出，也可以是点的列表或文件。',
  ],
  values: { structure: 'ring', energy: 'springs', cells: 3, young: 1e6, step: 2e-4 },
  choices: [
    {
      key: 'structure',
      name: ['mesh', '网格'],
      options: [
        ['ring', ['a ring that hangs', '悬挂的圆环']],
        ['bridge', ['a bridge', '桥']],
        ['flag', ['a square on one corner', '挂住一角的方块']],
      ],
    },
    {
      key: 'energy',
      name: ['energy', '能量'],
      options: [
        ['springs', ['springs', '弹簧']],
        ['elements', ['finite elements', '有限元']],
      ],
    },
  ],
  sliders: [
    { key: 'cells', name: ['fineness', '网格密度'], unit: '', min: 1, max: 6, whole: true, step: 1 },
    {
      key: 'young',
      name: ['stiffness', '刚度'],
      unit: 'Pa',
      min: 1e5,
      max: 1e7,
      log: true,
      path: v => (v.energy === 'springs' ? 'body.0.springs.young' : 'body.0.elastic.corotated.young'),
    },
    { ...STEP_SIZE, min: 2e-5, max: 5e-3 },
  ],
  scene: woven,
  kind: v => v.structure,
  shape: v => `${v.structure} ${v.cells} ${v.energy}`,
  view: v => VIEWS[v.structure],
  limit: { slider: 'step', scene: v => woven({ ...v, step: HUGE_STEP }) },
  end: () => 2,
  speed: 0.5,
  state: energies,
  frame: ({ time, positions }) => {
    let low = Infinity;
    for (let k = 1; k < positions.length; k += 2) low = Math.min(low, positions[k]);
    return { time, low };
  },
  charts: [
    run => ({
      name: say(['height of the lowest point [m]', '最低点的高度 [m]']),
      x: { label: say(seconds), low: 0, high: Math.max(2, run.time) },
      y: {},
      lines: ownLines(run, 'frames', [['low', ofRun, 0]]),
    }),
    run => energyChart(run, 2),
  ],
  numbers: run => (run.limit ? [['limit', sayTime(run.limit)]] : []),
  tries: [
    {
      text: [
        'Exchange springs for finite elements. The same number in the scene gives another stiffness: ' +
          'springs along edges are no continuum.',
        '把弹簧换成有限元：场景里同样的数值对应不同的刚度，因为沿边的弹簧不是连续体。',
      ],
      set: { structure: 'ring', energy: 'elements' },
    },
    {
      text: [
        'Make the mesh finer. The largest stable step shrinks with the shortest edge.',
        '加密网格：最大稳定步长随最短边一起变小。',
      ],
      set: { structure: 'bridge', energy: 'elements', cells: 6, step: 1e-4 },
    },
    {
      text: [
        'Open the scene in the editor. Add `damping = { mass_proportional = 2 }` to the body.',
        '在编辑器中打开场景，给物体加上 damping = { mass_proportional = 2 }。',
      ],
    },
  ],
};

const STEPS = [
  equationOfMotion,
  integration,
  galaxy,
  springs,
  deformation,
  elements,
  inversion,
  cloth,
  weave,
];
