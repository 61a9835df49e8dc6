// Faults of the page as it is shown now, each as a sentence: text cut off, too small or too faint, targets too small or
// over one another, and something that scrolls within something that scrolls.
({ leastTargetPx, leastTextPx, leastContrast }) => {
  const faults = new Set();
  const TARGETS = "button, input, select, textarea, a[href], summary, [role=tab], [role=slider], [role=button], [tabindex='0']:not([role=separator])"; // a bar is long and thin
  const words = (one) => (one.getAttribute("aria-label") || one.value || one.textContent || "").trim().slice(0, 40) || one.id || one.className;
  const name = (one) => `${one.tagName.toLowerCase()} "${words(one)}"`;
  const style = (one) => getComputedStyle(one);
  const ancestors = (one) => {
    const found = [];
    for (let next = one.parentElement; next !== null; next = next.parentElement) found.push(next);
    return found;
  };
  // A fixed element is not clipped by what it stands in, an absolute one by nothing within what it is placed by.
  const clippers = (one) => {
    const found = [];
    let isPlaced = false; // by something further out
    for (let next = one; next.parentElement !== null && style(next).position !== "fixed"; next = next.parentElement) {
      isPlaced = style(next).position === "absolute" || (isPlaced && style(next).position === "static");
      const isFree = isPlaced && style(next.parentElement).position === "static";
      if (style(next.parentElement).overflow !== "visible" && !isFree) found.push(next.parentElement);
    }
    return found;
  };
  const isSeen = (one) => {
    const { width, height } = one.getBoundingClientRect();
    const isShown = one.checkVisibility({ visibilityProperty: true, opacityProperty: true });
    return isShown && width > 1 && height > 1 && ![one, ...ancestors(one)].some((next) => style(next).clipPath !== "none");
  };
  // The part of a box that is to be seen, where it is neither scrolled away nor off the page; null for none.
  const inView = (one) => {
    let { left, top, right, bottom } = one.getBoundingClientRect();
    for (const box of [...clippers(one).map((next) => next.getBoundingClientRect()), { left: 0, top: 0, right: innerWidth, bottom: innerHeight }]) {
      [left, top, right, bottom] = [Math.max(left, box.left), Math.max(top, box.top), Math.min(right, box.right), Math.min(bottom, box.bottom)];
    }
    return right - left > 1 && bottom - top > 1 ? { left, top, right, bottom } : null;
  };

  const all = [...document.body.querySelectorAll("*")].filter((one) => !["SCRIPT", "STYLE", "NOSCRIPT", "TITLE"].includes(one.tagName) && isSeen(one));
  const texts = all.filter((one) => [...one.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.textContent.trim() !== ""));
  const inputs = all.filter((one) => one.matches("input:not([type=checkbox], [type=file], [type=hidden]), textarea"));

  // Text.
  for (const one of [...texts, ...inputs]) {
    const size = parseFloat(style(one).fontSize);
    if (size < leastTextPx - 0.01) faults.add(`${name(one)}: text of ${size} px`);
  }
  const isScrolled = (one, axis) => /auto|scroll/.test(style(one)[`overflow${axis}`]);
  // Words that end in an ellipsis where there is no room are all told by a title.
  const isShortened = (one) => (style(one).textOverflow === "ellipsis" || style(one).webkitLineClamp !== "none") && style(one).overflow !== "visible";
  const isTold = (one) => [one, ...ancestors(one)].some((next) => isShortened(next) && [next, ...ancestors(next)].some((above) => above.title));
  for (const one of texts.filter((next) => !(next instanceof SVGElement) && !isTold(next))) {
    if (style(one).textOverflow === "ellipsis" && style(one).overflow !== "visible" && one.clientWidth > 0) {
      if (one.scrollWidth > one.clientWidth + 1) faults.add(`${name(one)}: cut off`);
      continue;
    }
    const range = document.createRange();
    range.selectNodeContents(one);
    const text = range.getBoundingClientRect();
    for (const box of [one, ...clippers(one)].filter((next) => style(next).overflow !== "visible")) {
      const { left, right, top, bottom } = box.getBoundingClientRect();
      if (!isScrolled(box, "X") && (text.left < left - 1 || text.right > right + 1)) faults.add(`${name(one)}: cut off at the side`);
      if (isScrolled(box, "Y")) break;
      if (text.top < top - 3 || text.bottom > bottom + 3) faults.add(`${name(one)}: cut off above or below`);
    }
    if (text.left < -1 || text.right > innerWidth + 1) faults.add(`${name(one)}: beyond the page's side`);
  }
  for (const one of inputs) if (one.tagName === "INPUT" && one.scrollWidth > one.clientWidth + 1 && !one.title) faults.add(`${name(one)}: cut off in its box`);

  // Contrast: of the computed colours, laid over each other.
  const pixel = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (colour) => {
    pixel.canvas.width = 1;
    pixel.fillStyle = colour;
    pixel.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = pixel.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const over = (top, below, opacity) => top.slice(0, 3).map((one, part) => one * top[3] * opacity + below[part] * (1 - top[3] * opacity));
  const luminance = (colour) => {
    const [r, g, b] = colour.map((one) => (one <= 10.3 ? one / 255 / 12.92 : ((one / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const isOff = (one) => one.disabled || [...ancestors(one)].some((next) => next.disabled || next.dataset?.disabled === "true");
  for (const one of [...texts, ...inputs].filter((next) => !(next instanceof SVGElement) && !isOff(next))) {
    if (one.closest(".stage") || one.closest("[role=status] .unread")) continue; // over the picture, on grounds of its own
    let [ground, opacity] = [[255, 255, 255], 1];
    for (const next of [...ancestors(one).reverse(), one]) {
      opacity *= parseFloat(style(next).opacity);
      ground = over(rgba(style(next).backgroundColor), ground, opacity);
    }
    if (!/[\p{L}\d]/u.test(words(one))) continue; // a mark beside words
    const [light, dark] = [luminance(over(rgba(style(one).color), ground, opacity)), luminance(ground)].sort((a, b) => b - a);
    const contrast = (light + 0.05) / (dark + 0.05);
    if (contrast < leastContrast) faults.add(`${name(one)}: contrast ${contrast.toFixed(2)}`);
  }

  // Targets. A link among words is as high as they are; a box to tick is hit by the row it stands in.
  const targets = all.filter((one) => one.matches(TARGETS) && !isOff(one) && style(one).pointerEvents !== "none" && !one.matches("[type=file], [type=hidden], .stage"));
  const track = (one) => one.closest(".mantine-Slider-root");
  // How high a slider's track takes a press, which is more than is drawn of it; where it is scrolled away, enough.
  const reach = (one) => {
    const { left, top, height } = one.getBoundingClientRect();
    const [x, y] = [left + 2, top + height / 2];
    const isAtEdge = clippers(one).some((next) => ["top", "bottom"].some((edge) => Math.abs(next.getBoundingClientRect()[edge] - y) < leastTargetPx));
    if (!inView(one) || isAtEdge) return leastTargetPx;
    const isHit = (way) => track(document.elementFromPoint(x, y + way) ?? document.body) === track(one);
    let high = 1;
    for (const sign of [-1, 1]) for (let way = 1; way < leastTargetPx && isHit(sign * way); way += 1) high += 1;
    return high;
  };
  for (const one of targets.filter((next) => !next.matches("a"))) {
    const box = (track(one) ?? one).getBoundingClientRect();
    const [width, height] = [box.width, track(one) ? reach(one) : box.height];
    if (Math.min(width, height) < leastTargetPx - 0.5) faults.add(`${name(one)}: target of ${Math.round(width)} x ${Math.round(height)} px`);
  }
  const placed = targets.map((one) => [one, inView(one)]).filter(([, box]) => box !== null);
  placed.forEach(([one, box], index) => {
    for (const [other, its] of placed.slice(index + 1)) {
      if (one.contains(other) || other.contains(one) || (track(one) && track(one) === track(other))) continue;
      const wide = Math.min(box.right, its.right) - Math.max(box.left, its.left);
      const high = Math.min(box.bottom, its.bottom) - Math.max(box.top, its.top);
      if (wide > 1 && high > 1) faults.add(`${name(one)} lies over ${name(other)}`);
    }
  });

  // Scrolling.
  const scrolls = (one) => ["X", "Y"].some((axis) => isScrolled(one, axis)
    && (axis === "X" ? one.scrollWidth > one.clientWidth + 1 : one.scrollHeight > one.clientHeight + 1));
  const scrolling = all.filter((one) => one.tagName !== "TEXTAREA" && scrolls(one));
  for (const one of scrolling) {
    if (one.scrollWidth > one.clientWidth + 1 && isScrolled(one, "X")) faults.add(`${name(one)}: scrolls to the side`);
    if (scrolling.some((other) => other !== one && other.contains(one))) faults.add(`${name(one)}: scrolls within what scrolls`);
  }
  const { scrollWidth, scrollHeight } = document.documentElement;
  if (scrollWidth > innerWidth || scrollHeight > innerHeight) faults.add("the page itself scrolls");
  return [...faults];
}
