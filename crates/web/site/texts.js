// Texts of the pages around a run, in English and Chinese. What the program itself says is in English.
'use strict';

/** An element of the page by its `id`, and a new one with properties and content. */
const by = id => document.getElementById(id);
const made = (name, properties, ...content) => {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...content);
  return element;
};

const TEXTS = {
  title: ['pliant in the browser', '浏览器里的 pliant'],
  lecture: ['The lecture', '课程演示'],
  editorLink: ['Editor', '场景编辑器'],
  scene: ['Scene', '场景'],
  picture: ['Picture', '画面'],
  shipped: ['Example scenes', '示例场景'],
  ownScene: ['your scene', '自己的场景'],
  run: ['Run', '运行'],
  runHint: ['Run the scene (Ctrl+Enter)', '运行场景（Ctrl+Enter）'],
  copyLink: ['Copy link', '复制链接'],
  copied: ['The link holds the whole scene', '链接已复制，其中包含整个场景'],
  copyByHand: ['Copy the link from the address bar', '请从地址栏复制链接'],
  filesInLink: [
    'The link does not hold the mesh files; send them with it',
    '链接不包含网格文件，请一并发送这些文件',
  ],
  addFiles: ['Add meshes', '添加网格'],
  addFilesHint: [
    'Files for the scene: .obj, .stl, .msh, .vtu, .vtk, .inp. You can also drop them on the page.',
    '供场景使用的文件：.obj、.stl、.msh、.vtu、.vtk、.inp，也可以直接拖到页面上。',
  ],
  drop: ['Drop a scene or meshes', '松开以载入场景或网格'],
  unknownFile: ['is not a scene or a mesh that pliant reads', '不是 pliant 能读取的场景或网格'],
  remove: ['remove', '移除'],
  download: ['Download', '下载记录'],
  downloadHint: [
    'The run so far as an MCAP file, for `pliant view` and `pliant info`',
    '把目前为止的运行保存为 MCAP 文件，可用 pliant view 和 pliant info 打开',
  ],
  theme: ['Theme', '主题'],
  language: ['中文', 'English'],
  loading: ['Loading the simulator', '正在载入仿真器'],
  opening: ['Assembling the scene', '正在组装场景'],
  colon: [': ', '：'],
  line: ['line', '第'],
  lineAfter: ['', '行'],
  column: ['column', '第'],
  columnAfter: ['', '列'],
  help: ['Remedy', '修改建议'],
  note: ['Note', '说明'],
  details: ['Full message', '完整信息'],
  close: ['Close', '关闭'],
  trap: ['The simulator stopped (a defect of pliant)', '仿真器意外停止（pliant 的缺陷）'],
  tryAgain: ['Run again to start a new one.', '再次运行即可重新启动。'],
  timeHere: ['{} a step here', '浏览器中每步 {}'],
  timeNative: ['{} in the native program', '原生程序每步 {}'],
  nativeHint: [
    'Measured when this site was made, with the native program on',
    '制作本网站时用原生程序测得，处理器：',
  ],
  threads: ['threads', '线程'],
  limits: ['One thread, no AVX', '单线程，无 AVX'],
  limitsHint: [
    'The browser runs the same program on one thread and without AVX: each step takes longer. Positions ' +
      'have the same bits as those of the native program; only where large matrices are factorised do the ' +
      'last digits differ.',
    '浏览器中运行的是同一个程序，但只用单线程，也没有 AVX 指令，每一步更慢。' +
      '位置的每一位都与原生程序相同；只有分解大型矩阵时，末尾几位会有差别。',
  ],
  bits: ['Compare bits', '逐位比较'],
  bitsHint: [
    'Takes the first steps of this scene and compares the SHA-256 of all positions with that of the native ' +
      'program',
    '计算这个场景的前若干步，把全部位置的 SHA-256 与原生程序的比较',
  ],
  comparing: ['comparing', '正在比较'],
  bitsEqual: ['equal to native: {} steps, SHA-256 {}', '与原生程序逐位相同：{} 步，SHA-256 {}'],
  bitsDiffer: ['other bits than native after {} steps', '{} 步之后与原生程序不完全相同'],
  old: ['This browser is too old: it has no CompressionStream.', '浏览器版本过旧：缺少 CompressionStream。'],
  badLink: ['The scene in the link cannot be read.', '无法读取链接中的场景。'],

  // The lecture.
  previous: ['Previous', '上一步'],
  next: ['Next', '下一步'],
  formula: ['Formula', '公式'],
  theirs: ['The lecture’s program, in our words', '课程程序的要点（我们的写法）'],
  ours: ['The same in pliant', '在 pliant 中'],
  tries: ['What to try', '动手试试'],
  pause: ['Pause', '暂停'],
  play: ['Continue', '继续'],
  oneStep: ['One step', '单步'],
  reset: ['Start again', '重新开始'],
  speed: ['Speed', '速度'],
  asFast: ['as fast as it goes', '尽可能快'],
  openInEditor: ['Open in the editor', '在编辑器中打开'],
  before: ['run before', '上一次运行'],
  limit: ['largest stable step', '最大稳定步长'],
  limitOfExplicit: ['largest stable step of symplectic Euler', '辛欧拉法的最大稳定步长'],
  pullHint: ['Drag a vertex to pull it.', '拖动顶点即可拉动物体。'],
  turnHint: [
    'Drag to turn the picture; shift and drag pulls a vertex.',
    '拖动可旋转画面；按住 Shift 拖动可拉顶点。',
  ],
  refused: ['pliant refuses this scene', 'pliant 拒绝此场景'],
  failed: ['The run has stopped', '运行已停止'],
  english: ['', '（程序消息为英文）'],
  numbers: [
    'All numbers on these pages come from the run next to them or from a formula.',
    '这些页面上的数字都来自旁边的运行或公式。',
  ],
};

/** Language and theme of the pages, kept for the next visit. */
const settings = (() => {
  const kept = name => {
    try {
      return localStorage.getItem(`pliant-${name}`);
    } catch {
      return null;
    }
  };
  const asked = new URLSearchParams(location.search).get('lang');
  const own = navigator.language?.toLowerCase().startsWith('zh') ? 'zh' : 'en';
  const language = [asked, kept('language'), own].find(name => ['en', 'zh'].includes(name));
  return {
    language,
    theme: kept('theme'),
    listeners: [],
    set(name, value) {
      this[name] = value;
      try {
        localStorage.setItem(`pliant-${name}`, value);
      } catch {
        // Without storage, the choice holds for this page.
      }
      this.apply();
    },
    apply() {
      document.documentElement.lang = this.language === 'zh' ? 'zh-Hans' : 'en';
      if (this.theme) document.documentElement.dataset.theme = this.theme;
      for (const marked of document.querySelectorAll('[data-text]'))
        marked.textContent = say(marked.dataset.text);
      for (const marked of document.querySelectorAll('[data-hint]')) marked.title = say(marked.dataset.hint);
      this.listeners.forEach(changed => changed());
    },
    turnTheme() {
      const dark = matchMedia('(prefers-color-scheme: dark)').matches;
      this.set('theme', (this.theme ?? (dark ? 'dark' : 'light')) === 'dark' ? 'light' : 'dark');
    },
    turnLanguage() {
      this.set('language', this.language === 'zh' ? 'en' : 'zh');
    },
  };
})();

/** Text by its name in the chosen language, or the one of `[english, chinese]`. */
const say = text => (Array.isArray(text) ? text : TEXTS[text])[settings.language === 'zh' ? 1 : 0];

/** `line 3, column 5` of a refused scene. */
function sayPlace({ line, column }) {
  const part = (before, number, after) =>
    settings.language === 'zh' ? `${say(before)} ${number} ${say(after)}` : `${say(before)} ${number}`;
  if (line === null) return '';
  const place = part('line', line, 'lineAfter');
  if (column === null) return place;
  return `${place}${settings.language === 'zh' ? '，' : ', '}${part('column', column, 'columnAfter')}`;
}

/** Simulated or elapsed time with three digits and a prefix. */
function sayTime(seconds) {
  if (!(seconds > 0)) return seconds === 0 ? '0 s' : '–';
  const [unit, size] = [
    ['s', 1],
    ['ms', 1e-3],
    ['µs', 1e-6],
    ['ns', 1e-9],
  ].find(([, size]) => seconds >= size) ?? ['ns', 1e-9];
  return `${Number((seconds / size).toPrecision(3))} ${unit}`;
}

/** A number with three digits. */
function sayNumber(value, digits = 3) {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) {
    const [mantissa, power] = value.toExponential(digits - 1).split('e');
    const raised = [...String(Number(power))]
      .map(sign => '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'['-0123456789'.indexOf(sign)])
      .join('');
    return Number(mantissa) === 1 ? `10${raised}` : `${Number(mantissa)}·10${raised}`;
  }
  return String(Number(value.toPrecision(digits)));
}

/** Text of a scene in a link, and back. */
const sceneLink = {
  async write(text) {
    const bytes = await deflated(new TextEncoder().encode(text));
    const base64 = btoa(Array.from(bytes, byte => String.fromCharCode(byte)).join(''));
    return base64.replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '');
  },
  async read(part) {
    const bytes = bytesOfBase64(part.replaceAll('-', '+').replaceAll('_', '/'));
    return new TextDecoder().decode(await inflated(bytes));
  },
};
