// The viewer page: opens a file by drag and drop, by the button, or from ?src=URL, and shows what it cost.
import { createReliefDecoder } from 'relief-gltf';

import { loadModel } from './model.js';
import { Stage } from './stage.js';

const element = id => document.getElementById(id);
const whole = new Intl.NumberFormat('en');
const stage = new Stage(element('canvas'));
const decoder = createReliefDecoder();
let opening = 0;  // of two files opened in a hurry the later one wins

function showNumber(id, value, text = whole.format(value)) {
  element(id).dataset.value = value;
  element(id).textContent = text;
}

function bytesText(bytes) {
  return bytes < 1e6 ? `${whole.format(bytes)} B` : `${(bytes / 1e6).toFixed(2)} MB`;
}

function showFigures({ name, fileBytes, streams, vertices, triangles }) {
  element('name').textContent = element('name').title = name;
  showNumber('file-bytes', fileBytes, bytesText(fileBytes));
  showNumber('stream-bytes', streams.bytes, streams.count ? `${streams.count} with ${bytesText(streams.bytes)}` : 'none');
  showNumber('vertices', vertices);
  showNumber('triangles', triangles);
  showNumber('decode-ms', streams.milliseconds, streams.count ? `${streams.milliseconds.toFixed(1)} ms` : '–');
  element('figures').hidden = false;
}

function showError(name, error) {
  const code = error.code ? ` (${error.code})` : '';
  element('error').textContent = `${name}: ${error.message}${code}`;
  element('error').hidden = false;
  document.body.dataset.state = 'error';
}

// Opens a file; `bytes` resolves to its contents, `base` is where the files it mentions are looked for.
async function open(name, bytes, base) {
  const mine = ++opening;
  document.body.dataset.state = 'busy';
  document.body.classList.add('busy');
  element('error').hidden = element('hint').hidden = true;
  try {
    const contents = new Uint8Array(await bytes);
    const model = await loadModel(contents, base, await decoder);
    if (mine !== opening) return;
    stage.show(model.object);
    showFigures({ name, fileBytes: contents.length, ...model });
    document.body.dataset.state = 'ready';
  } catch (error) {
    if (mine === opening) showError(name, error);
  } finally {
    if (mine === opening) document.body.classList.remove('busy');
  }
}

async function fetchBytes(url) {
  const response = await fetch(url).catch(() => { throw new Error('could not be reached'); });
  if (!response.ok) throw new Error(`HTTP status ${response.status}`);
  return response.arrayBuffer();
}

function openFile(file) {
  if (file) open(file.name, file.arrayBuffer(), '');
}

element('file').addEventListener('change', event => {
  openFile(event.target.files[0]);
  event.target.value = '';
});
window.addEventListener('dragover', event => {
  event.preventDefault();
  document.body.classList.add('dropping');
});
window.addEventListener('dragleave', event => {
  if (event.relatedTarget === null) document.body.classList.remove('dropping');
});
window.addEventListener('drop', event => {
  event.preventDefault();
  document.body.classList.remove('dropping');
  openFile(event.dataTransfer.files[0]);
});
element('modes').addEventListener('click', event => {
  const mode = event.target.dataset.mode;
  if (!mode) return;
  for (const button of element('modes').children) button.ariaPressed = String(button === event.target);
  stage.setMode(mode);
});

const source = new URLSearchParams(location.search).get('src');
if (source) {
  const url = new URL(source, location.href);
  open(url.pathname.split('/').pop(), fetchBytes(url), new URL('.', url).href);
}
