// The page: a recording that is played or, where the page says how to reach it, a run that goes on.
import { readHead } from 'pliant/data';
import { View } from 'pliant/view';
import { LiveView } from 'pliant/live';

const live = document.getElementById('live'),
  head = await readHead();
const view = live ? new LiveView(head, JSON.parse(live.textContent)) : new View(head);
await view.start();
view.publish();
