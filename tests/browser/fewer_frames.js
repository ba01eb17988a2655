// Draws a page ten times a second: software rendering at the rate of a screen takes every core.
"use strict";
(() => {
  const PERIOD = 100; // ms
  const draw = window.requestAnimationFrame.bind(window);
  let waiting = new Map();
  let number = 0;
  let drawn = -Infinity;
  let timer = null;

  function next(time) {
    timer = null;
    drawn = performance.now();
    const callbacks = waiting;
    waiting = new Map();
    for (const callback of callbacks.values()) callback(time);
  }

  window.requestAnimationFrame = (callback) => {
    waiting.set(++number, callback);
    timer ??= setTimeout(draw, Math.max(0, drawn + PERIOD - performance.now()), next);
    return number;
  };
  window.cancelAnimationFrame = (which) => waiting.delete(which);
})();
