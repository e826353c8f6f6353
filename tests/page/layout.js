// Looks for what should not be: panels over one another or out of the window, texts over one another or cut off, charts
// without room. Evaluates to a list of complaints.
(() => {
  const complaints = [];
  const box = (node) => node.getBoundingClientRect();
  const name = (node) => node.dataset?.testid ?? node.getAttribute("aria-labelledby") ?? `${node.tagName.toLowerCase()}.${node.className}`;
  const meet = (a, b) => [Math.min(a.right, b.right) - Math.max(a.left, b.left), Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top)];
  const seen = (node) => node.checkVisibility({ visibilityProperty: true });

  const panels = [...document.querySelectorAll(".head, .banner, .panel")].filter(seen);
  panels.forEach((panel, i) => {
    const at = box(panel);
    if (at.left < -0.5 || at.top < -0.5 || at.right > innerWidth + 0.5 || at.bottom > innerHeight + 0.5) complaints.push(`${name(panel)} leaves the window`);
    for (const other of panels.slice(i + 1)) {
      const [w, h] = meet(at, box(other));
      if (w > 0.5 && h > 0.5) complaints.push(`${name(panel)} and ${name(other)} overlap`);
    }
    for (const child of panel.children) {
      if (!seen(child) || child.matches("datalist")) continue;
      const inner = box(child);
      if (inner.bottom > at.bottom + 0.5 || inner.right > at.right + 0.5) complaints.push(`${name(child)} leaves ${name(panel)}`);
    }
  });
  const parts = [...document.querySelectorAll(".panel > *, .work > section > *")].filter(seen);
  parts.forEach((part, i) => parts.slice(i + 1).forEach((other) => {
    if (part.contains(other) || other.contains(part)) return;
    const [w, h] = meet(box(part), box(other));
    if (w > 0.5 && h > 0.5) complaints.push(`${name(part)} and ${name(other)} overlap`);
  }));

  for (const chart of document.querySelectorAll(".chart, .scenes canvas")) {
    if (seen(chart) && (box(chart).height < 60 || box(chart).width < 100)) complaints.push(`${name(chart)} has no room: ${box(chart).width} x ${box(chart).height}`);
  }

  // Texts, as far as what scrolls or cuts them shows them.
  const texts = [];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const node = walk.currentNode;
    const parent = node.parentElement;
    if (!node.data.trim() || !seen(parent) || parent.closest(".unseen, datalist, option, script")) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    for (const rect of range.getClientRects()) {
      let { left, top, right, bottom } = rect;
      for (let up = parent; up && up !== document.body; up = up.parentElement) {
        const { overflowX, overflowY } = getComputedStyle(up);
        if (overflowX === "visible" && overflowY === "visible") continue;
        const cut = box(up);
        left = Math.max(left, cut.left); right = Math.min(right, cut.right);
        top = Math.max(top, cut.top); bottom = Math.min(bottom, cut.bottom);
      }
      if (right - left > 1 && bottom - top > 1) texts.push({ node, left, top, right, bottom });
    }
    const { overflowX, textOverflow } = getComputedStyle(parent);
    const cut = parent.scrollWidth > parent.clientWidth + 1 && overflowX !== "visible";
    if (cut && !parent.title && !(parent.parentElement.title && textOverflow === "ellipsis")) complaints.push(`cut off: ${name(parent)}: ${parent.textContent.trim().slice(0, 60)}`);
    if (parent.matches("button") && parent.scrollWidth > parent.clientWidth + 1) complaints.push(`button too narrow: ${name(parent)}`);
  }
  texts.forEach((one, i) => {
    if (one.right > innerWidth + 1 || one.bottom > innerHeight + 1) complaints.push(`out of the window: ${one.node.data.trim().slice(0, 40)}`);
    for (const other of texts.slice(i + 1)) {
      if (other.node === one.node) continue;
      const [w, h] = meet(one, other);
      if (w > 2 && h > 3) complaints.push(`texts overlap: ${one.node.data.trim().slice(0, 40)} | ${other.node.data.trim().slice(0, 40)}`);
    }
  });
  return complaints;
})()
