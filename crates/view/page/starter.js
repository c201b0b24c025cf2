// Starts the page: unpacks the modules and gives them names. A classic script, because some browsers take no
// import map once a module script has begun.
(async () => {
  'use strict';
  const say = text => {
    document.getElementById('message').textContent = text;
  };
  window.pliant = { ready: false, faults: [] };
  const note = fault => {
    window.pliant.faults.push(String(fault));
    say('The page could not start: ' + fault);
  };
  addEventListener('error', event => note(event.message));
  addEventListener('unhandledrejection', event => note(event.reason));
  if (typeof DecompressionStream === 'undefined') {
    say('This browser is too old: it has no DecompressionStream.');
    return;
  }
  const unpack = async text => {
    const bytes = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
    return new Response(stream).text();
  };
  const imports = {};
  for (const block of document.querySelectorAll('script[data-module]')) {
    const text = await unpack(block.textContent);
    imports[block.dataset.module] = URL.createObjectURL(new Blob([text], { type: 'text/javascript' }));
    block.remove();
  }
  const map = document.createElement('script');
  map.type = 'importmap';
  map.textContent = JSON.stringify({ imports });
  document.head.append(map);
  await import('pliant/main').catch(note);
})();
