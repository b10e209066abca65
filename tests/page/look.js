// What is wrong with how a page looks: text that is cut, what sticks out, and text that is too faint (WCAG 2.2, 1.4.3); words of empty
// fields, too; and names that stand between the back quotes of a terminal.

(() => {
  const wrong = [];
  const pixel = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  const colours = new Map();
  function colour(text) {
    if (!colours.has(text)) {
      pixel.clearRect(0, 0, 1, 1);
      pixel.fillStyle = text;
      pixel.fillRect(0, 0, 1, 1);
      const [r, g, b, a] = pixel.getImageData(0, 0, 1, 1).data;
      colours.set(text, [r, g, b, a / 255]);
    }
    return colours.get(text);
  }
  const over = ([r, g, b, a], [x, y, z]) => [r * a + x * (1 - a), g * a + y * (1 - a), b * a + z * (1 - a), 1];
  const lightness = (rgb) => rgb.slice(0, 3).map((of) => of / 255).map((of) => (of <= 0.04045 ? of / 12.92 : ((of + 0.055) / 1.055) ** 2.4))
    .reduce((sum, of, at) => sum + of * [0.2126, 0.7152, 0.0722][at], 0);
  const ratio = (one, other) => { const [low, high] = [lightness(one), lightness(other)].sort((a, b) => a - b); return (high + 0.05) / (low + 0.05); };
  function behind(element) {
    const held = [];
    for (let one = element; one; one = one.parentElement) {
      held.push(colour(getComputedStyle(one).backgroundColor));
      if (held.at(-1)[3] === 1) break;
    }
    return held.reverse().reduce((under, of) => over(of, under), [255, 255, 255, 1]);
  }
  const scrolls = (element, way) => /auto|scroll/.test(getComputedStyle(element)[way]);
  const inside = (element, way) => { for (let one = element; one; one = one.parentElement) if (scrolls(one, way)) return true; return false; };
  const told = (element) => Boolean(element.closest("[title]")?.title);
  const called = (element) => `${element.tagName.toLowerCase()}.${[...element.classList].join(".")} «${(element.innerText ?? element.value ?? "").slice(0, 60)}»`;
  const texts = (element) => [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
  for (const element of document.querySelectorAll("body *")) {
    if (!element.checkVisibility({ visibilityProperty: true }) || element.closest("svg, canvas, option, datalist")) continue;
    const style = getComputedStyle(element);
    const { left, right, top, bottom, width, height } = element.getBoundingClientRect();
    if (!width || !height || style.display === "inline") { if (!texts(element)) continue; }
    if ((right > innerWidth + 1 || left < -1) && !inside(element.parentElement, "overflowX")) wrong.push(`sticks out sideways: ${called(element)}`);
    if ((bottom > innerHeight + 1 || top < -1) && !inside(element.parentElement, "overflowY")) wrong.push(`sticks out downwards: ${called(element)}`);
    if (element.placeholder && !element.value && !element.disabled) {
      pixel.font = style.font;
      const [room, wants] = [element.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight), pixel.measureText(element.placeholder).width];
      if (element.tagName === "INPUT" && wants > room + 1) wrong.push(`text is cut: ${called(element)} ${element.placeholder}, ${Math.ceil(wants)} > ${Math.floor(room)}`);
      const paper = behind(element), faint = ratio(over(colour(getComputedStyle(element, "::placeholder").color), paper), paper);
      if (faint < 4.5 - 0.005) wrong.push(`too faint: ${called(element)} ${element.placeholder}, ${faint.toFixed(2)}`);
    }
    if (!texts(element)) continue;
    if (!element.closest("pre, [role=log], .text-view") && [...element.childNodes].some((node) => node.nodeType === 3 && node.data.includes("`"))) wrong.push(`back quotes: ${called(element)}`);
    if (style.display !== "inline" && element.scrollWidth > element.clientWidth + 1 && !inside(element, "overflowX") && !(style.textOverflow === "ellipsis" && told(element)))
      wrong.push(`text is cut: ${called(element)}, ${element.scrollWidth} > ${element.clientWidth}`);
    if (element.closest(":disabled")) continue;
    const paper = behind(element);
    const faint = ratio(over(colour(style.color), paper), paper);
    if (faint < 4.5 - 0.005) wrong.push(`too faint: ${called(element)}, ${faint.toFixed(2)}`);
  }
  return [...new Set(wrong)];
})()
