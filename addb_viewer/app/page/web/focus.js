// Gives the keyboard back to the review keys after a click: the page ignores them while an input has the focus,
// and a checkbox or a list keeps it. People who move by keyboard keep their focus where it is, and in a dialog it stays.
(() => {
  let pointerAt = -Infinity;
  const release = () => {
    if (!document.activeElement?.closest("dialog, [role=dialog]")) document.activeElement?.blur?.();
  };
  // The page's own handlers may take the focus back, a list when it has faded out; so more than once, but never
  // from somebody who has clicked elsewhere meanwhile.
  const releaseSoon = () => {
    const click = pointerAt;
    for (const delay of [0, 100, 300, 600]) setTimeout(() => pointerAt === click && release(), delay);
  };
  const byPointer = () => performance.now() - pointerAt < 1000;
  const lastUse = () => (pointerAt = performance.now());
  document.addEventListener("pointerdown", lastUse, true);
  document.addEventListener(
    "pointerup",
    () => {
      lastUse();
      if (document.activeElement?.getAttribute("role") === "slider") releaseSoon();
    },
    true,
  );
  document.addEventListener("click", (event) => {
    if (byPointer() && event.target.closest?.("[role=option], [role=tab], input[type=checkbox], button")) releaseSoon();
  });
  document.addEventListener("keydown", (event) => {
    const typed = event.target instanceof HTMLInputElement && event.target.type !== "checkbox";
    if (typed && (event.key === "Enter" || event.key === "Escape")) release();
  });
})();
