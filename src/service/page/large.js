// A worker: reads a large answer beside the page, which stays quick meanwhile.

import { read } from './answers.js';

addEventListener('message', ({ data: { bytes, kind } }) => {
  try {
    postMessage({ answer: read(bytes, kind) });
  } catch (error) {
    postMessage({ fault: error.message });
  }
});
