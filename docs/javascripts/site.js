// The theme's buttons of a code block stand in a landmark without a name.
new MutationObserver(() => {
  for (const nav of document.querySelectorAll(".md-code__nav:not([role])")) {
    nav.setAttribute("role", "none");
  }
}).observe(document.body, {childList: true, subtree: true});
