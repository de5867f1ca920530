"use strict";
// The flip view: ours, the reference, their difference and the tiles, as numbers under the pointer.
const data = JSON.parse(document.getElementById("viewer-data").textContent);
const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const colours = bytesOf(data.colours);

const halves = new Float32Array(65536).map((_, bits) => {
  const sign = bits >> 15 ? -1 : 1, exponent = (bits >> 10) & 31, fraction = bits & 1023;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return sign * (exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : 2 ** -24 * fraction);
});

async function decode({ blob, exponent }) {
  const packed = bytesOf(document.getElementById(blob).textContent);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const n = planes.length / 2, scale = 2 ** exponent;
  return Float32Array.from({ length: n }, (_, i) => halves[(planes[i] << 8) | planes[n + i]] * scale);
}

const rounded = (v) => (Number.isFinite(v) ? Number(v.toPrecision(4)).toString() : String(v));
const signed = (v, digits = 2) => (Number(v.toFixed(digits)) < 0 ? "−" : "+") + Math.abs(v).toFixed(digits);
const clamp = (v, low, high) => Math.min(Math.max(v, low), high);

class Viewer {
  constructor(root) {
    this.root = root;
    this.canvas = root.querySelector("canvas");
    this.told = root.querySelector(".value");
    this.exposure = root.querySelector("input[type=range]");
    this.curve = root.querySelector(".curve input");
    this.info = data.images[root.dataset.row];
    this.tiles = data.tiles[root.dataset.row];
    this.layers = {};
    this.zoom = 0; // 0: fit
    this.centre = [this.info.width / 2, this.info.height / 2];
    this.at = null;
    this.image = new OffscreenCanvas(this.info.width, this.info.height);
    this.listen();
  }

  get view() { return this.root.querySelector(".views input:checked").value; }
  set view(name) {
    const input = this.root.querySelector(`.views input[value=${name}]`);
    if (input) { input.checked = true; this.paint(); }
  }

  async load() {
    for (const [name, layer] of Object.entries(this.info.layers)) this.layers[name] = await decode(layer);
    this.paint();
    this.root.dataset.ready = "yes";
  }

  listen() {
    const { canvas, root } = this;
    root.querySelector(".views").addEventListener("change", () => this.paint());
    this.exposure.addEventListener("input", () => this.paint());
    this.curve.addEventListener("change", () => this.paint());
    root.querySelector(".zoom").addEventListener("click", ({ target }) => this.zoomTo(target.dataset.zoom));
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("pointerdown", (event) => {
      this.drag = { from: [event.clientX, event.clientY], centre: [...this.centre] };
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointerup", () => { this.drag = null; });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return; // a plain wheel scrolls the page
      event.preventDefault();
      this.zoomTo(event.deltaY < 0 ? "in" : "out");
    }, { passive: false });
    new ResizeObserver(() => this.show()).observe(canvas);
  }

  move(event) {
    const box = this.canvas.getBoundingClientRect(), { scale, left, top } = this.placing();
    if (this.drag && this.zoom) {
      this.centre = this.drag.centre.map((c, i) => c - ([event.clientX, event.clientY][i] - this.drag.from[i]) / scale);
    } else {
      this.point(Math.floor((event.clientX - box.left - left) / scale), Math.floor((event.clientY - box.top - top) / scale));
    }
    this.show();
  }

  point(x, y) {
    const inside = x >= 0 && y >= 0 && x < this.info.width && y < this.info.height;
    this.at = inside ? [x, y] : null;
    this.told.textContent = inside ? this.words(x, y) : " ";
  }

  words(x, y) {
    const { width, height, factor } = this.info, n = width * height, i = y * width + x;
    const colour = (layer) => [0, 1, 2].map((c) => rounded(layer[c * n + i])).join("  ");
    const lines = [`x ${x * factor}, y ${y * factor}   ${this.root.dataset.whose} ${colour(this.layers.ours)}`];
    if (this.layers.reference) lines[0] += `   ${this.root.dataset.other} ${colour(this.layers.reference)}`;
    if (this.layers.mistaken) lines[0] += `   with mistake ${colour(this.layers.mistaken)}`;
    const last = [];
    if (this.layers.signed) last.push(`difference ${signed(this.layers.signed[i], 3)} % of the mean`);
    if (this.layers.difference) last.push(`difference ${signed(this.layers.difference[i])} standard errors`);
    if (this.tiles) {
      const side = this.tiles.side, at = Math.floor((y * side) / height) * side + Math.floor((x * side) / width);
      const p = this.tiles.p[at], bias = this.tiles.bias[at];
      if (bias !== null) last.push(`tile bias ${signed(100 * bias, 3)} %` + (p === null ? "" : `, p ${rounded(p)}`));
    }
    return [...lines, last.join("   ")].join("\n");
  }

  key(event) {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const name = event.key.toLowerCase();
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (step) {
      const by = event.shiftKey ? 10 : 1, [x, y] = this.at || this.centre.map(Math.floor);
      this.point(clamp(x + by * step[0], 0, this.info.width - 1), clamp(y + by * step[1], 0, this.info.height - 1));
      this.show();
    } else if (name === "f" || name === " ") this.view = this.view === "ours" ? "reference" : "ours";
    else if (name === "m" && this.layers.mistaken) this.view = "mistaken";
    else if (name === "d") this.view = this.layers.signed ? "signed" : "difference";
    else if (name === "z" && this.layers.signed) this.view = "difference";
    else if (name === "t") this.view = "tiles";
    else if (name === "e") { this.exposure.value = Number(this.exposure.value) + (event.shiftKey ? -0.5 : 0.5); this.paint(); }
    else if (name === "+" || name === "=") this.zoomTo("in");
    else if (name === "-") this.zoomTo("out");
    else if (name === "0") this.zoomTo("fit");
    else return;
    event.preventDefault();
  }

  zoomTo(how) {
    if (!how) return;
    if (how === "in" && this.at) this.centre = this.at.map((v) => v + 0.5);
    const now = this.zoom || this.fitting();
    this.zoom = how === "fit" ? 0 : clamp(how === "in" ? now * 1.5 : now / 1.5, this.fitting(), 48);
    if (this.zoom <= this.fitting()) { this.zoom = 0; this.centre = [this.info.width / 2, this.info.height / 2]; }
    this.show();
  }

  fitting() { return this.canvas.clientWidth / this.info.width || 1; }

  placing() {
    const scale = this.zoom || this.fitting(), { clientWidth, clientHeight } = this.canvas;
    return { scale, left: clientWidth / 2 - this.centre[0] * scale, top: clientHeight / 2 - this.centre[1] * scale };
  }

  paint() {
    const { width, height } = this.info, n = width * height, pixels = new ImageData(width, height);
    const view = this.view, ev = Number(this.exposure.value), out = pixels.data;
    this.root.querySelector(".exposure output").textContent = signed(ev);
    const signedView = view in data.ranges;
    for (const legend of this.root.querySelectorAll(".legend")) legend.hidden = !legend.dataset.of.split(" ").includes(view);
    for (const words of this.root.querySelectorAll(".of-tiles")) words.hidden = view !== "tiles";
    this.exposure.disabled = this.curve.disabled = signedView;
    if (signedView) this.paintSigned(out, n, view);
    else this.paintRadiance(out, n, this.layers[view], 2 ** ev, this.curve.checked);
    this.image.getContext("2d").putImageData(pixels, 0, 0);
    this.show();
  }

  paintRadiance(out, n, layer, gain, curve) {
    const tone = curve ? (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055) : (v) => v;
    for (let i = 0; i < n; i++) {
      const finite = Number.isFinite(layer[i] + layer[n + i] + layer[2 * n + i]);
      for (let c = 0; c < 3; c++) out[4 * i + c] = 255 * tone(clamp(layer[c * n + i] * gain, 0, 1));
      if (!finite) { out[4 * i] = out[4 * i + 2] = 255; out[4 * i + 1] = 0; } // magenta: not a finite number
      out[4 * i + 3] = 255;
    }
  }

  paintSigned(out, n, view) {
    const { width, height } = this.info, byTile = view === "tiles", side = byTile ? this.tiles.side : 0, range = data.ranges[view];
    for (let i = 0; i < n; i++) {
      const x = i % width, y = (i - x) / width;
      const z = byTile ? this.tiles.z[Math.floor((y * side) / height) * side + Math.floor((x * side) / width)] : this.layers[view][i];
      const shade = 3 * Math.round(255 * clamp((z + range) / (2 * range), 0, 1));
      for (let c = 0; c < 3; c++) out[4 * i + c] = z === null || Number.isNaN(z) ? 128 : colours[shade + c];
      out[4 * i + 3] = 255;
    }
  }

  writeTiles(context, left, top, scale) {
    const { side, p, z } = this.tiles, across = (this.info.width * scale) / side, down = (this.info.height * scale) / side;
    if (across < 40) return;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.font = "12px system-ui, sans-serif";
    p.forEach((value, i) => {
      if (value === null) return;
      context.fillStyle = Math.abs(z[i]) > 2.6 ? "#fff" : "#1b1d21";
      const words = value < 0.001 ? value.toExponential(0) : value.toFixed(value < 0.1 ? 3 : 2);
      context.fillText(words, left + ((i % side) + 0.5) * across, top + (Math.floor(i / side) + 0.5) * down);
    });
  }

  show() {
    const { canvas, info } = this, ratio = window.devicePixelRatio || 1, width = canvas.clientWidth;
    if (!width) return;
    const height = Math.round(Math.min((width * info.height) / info.width, window.innerHeight * 0.78));
    canvas.style.height = `${height}px`;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const { scale, left, top } = this.placing(), context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.imageSmoothingEnabled = scale < 1;
    context.drawImage(this.image, left, top, info.width * scale, info.height * scale);
    if (this.view === "tiles") this.writeTiles(context, left, top, scale);
    if (this.at) {
      const size = Math.max(scale, 5), at = this.at.map((v, i) => [left, top][i] + (v + 0.5) * scale - size / 2);
      context.strokeStyle = "#000"; context.strokeRect(at[0] - 1, at[1] - 1, size + 2, size + 2);
      context.strokeStyle = "#fff"; context.strokeRect(at[0], at[1], size, size);
    }
  }
}
