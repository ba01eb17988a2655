// A scene that is drawn without a graphics card: ten times a second and without antialiasing, which
// takes a software renderer most of its time. Otherwise it would take the processor from the cell.
"use strict";
(() => {
  const PERIOD = 100; // ms
  const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;
  const getContext = HTMLCanvasElement.prototype.getContext;

  function drawnBySoftware() {
    const context = getContext.call(document.createElement("canvas"), "webgl2");
    if (!context) return false;
    const names = context.getExtension("WEBGL_debug_renderer_info");
    const renderer = context.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : context.RENDERER);
    context.getExtension("WEBGL_lose_context")?.loseContext();
    return SOFTWARE.test(renderer);
  }

  if (!drawnBySoftware()) return;

  HTMLCanvasElement.prototype.getContext = function (kind, attributes) {
    const plain = kind.startsWith("webgl") ? { ...attributes, antialias: false } : attributes;
    return getContext.call(this, kind, plain);
  };

  const draw = window.requestAnimationFrame.bind(window);
  let waiting = new Map();
  let number = 0;
  let due = 0; // of the next frame
  let timer = null; // also while a frame is drawn

  function drawLater() {
    timer ??= setTimeout(draw, Math.max(0, due - performance.now()), next);
  }

  function next(time) {
    const began = performance.now();
    const callbacks = waiting;
    waiting = new Map();
    for (const callback of callbacks.values()) callback(time);
    // Presses and answers wait while a frame is drawn: half of the time is theirs.
    setTimeout(() => {
      const ended = performance.now();
      due = Math.max(began + PERIOD, ended + (ended - began));
      timer = null;
      if (waiting.size) drawLater();
    });
  }

  window.requestAnimationFrame = (callback) => {
    waiting.set(++number, callback);
    drawLater();
    return number;
  };
  window.cancelAnimationFrame = (which) => waiting.delete(which);
})();
