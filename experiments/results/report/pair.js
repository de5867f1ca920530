// Two viewers of one pair, A's and B's: what one points at and how far it is zoomed, the other follows.
const pair = [...document.querySelectorAll(".viewer")].map((root) => new Viewer(root));
for (const [one, other] of [[pair[0], pair[1]], [pair[1], pair[0]]].filter(([, other]) => other)) {
  const show = one.show.bind(one);
  one.show = () => {
    show();
    Object.assign(other, { zoom: one.zoom, centre: [...one.centre], at: one.at });
    Viewer.prototype.show.call(other);
  };
  one.paint = () => {
    Viewer.prototype.paint.call(one);
    if (other.exposure.value === one.exposure.value && other.curve.checked === one.curve.checked) return;
    other.exposure.value = one.exposure.value;
    other.curve.checked = one.curve.checked;
    Viewer.prototype.paint.call(other);
  };
}
for (const viewer of pair) {
  viewer.load().catch((error) => { viewer.told.textContent = `The images cannot be shown: ${error.message}`; });
}
