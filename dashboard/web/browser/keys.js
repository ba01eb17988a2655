// Arrow keys that a slider or a tab takes; viser's page would turn the view of the scene by them as
// well.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  document.body.addEventListener("keydown", (event) => {
    const taken = event.target.closest?.('[role="slider"], [role="tab"]');
    if (taken && event.key.startsWith("Arrow")) event.stopPropagation();
  });
});
