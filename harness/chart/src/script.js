"use strict";
// What a page does beyond lying there: names that switch their lines, a cursor that reads values and is shared by linked
// charts, zoom, charts and tables as files. The page is whole without it. Places are read from the paths; the numbers of a
// file of values have all their digits, and lie beside the chart as points.rs writes them.
(() => {
  const NS = "http://www.w3.org/2000/svg";
  const make = (name, attributes, parent) => {
    const e = document.createElementNS(NS, name);
    for (const k in attributes) e.setAttribute(k, attributes[k]);
    return parent.appendChild(e);
  };
  const minus = (text) => text.replace(/-/g, "\u2212");
  const digits = (v) => {
    const a = Math.abs(v);
    if (a === 0) return "0";
    if (a < 1e-3 || a >= 1e5) return minus(v.toExponential(3));
    return minus(v.toFixed(Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(a))))));
  };
  const heard = document.body.appendChild(document.createElement("div"));
  heard.className = "heard";
  heard.setAttribute("aria-live", "polite");

  const axis = (text) => {
    const [low, high, factor, ...unit] = text.split(" ");
    return { low: +low, high: +high, factor: +factor, unit: unit.join(" ") };
  };
  // points of a path, in px; a gap before each M; behind a point the shape of its mark
  const points = (path) => {
    const along = path.dataset.along ? path.dataset.along.split(" ").map(Number) : null;
    let i = 0;
    return [...path.getAttribute("d").matchAll(/([ML])(-?[\d.]+),(-?[\d.]+)([^ML]*)/g)].map((m) => ({
      gap: m[1] === "M", x: +m[2], y: +m[3], mark: m[4], along: along ? along[i++] : 0,
    }));
  };

  const tool = (box, text, name, act) => {
    const b = box.appendChild(document.createElement("button"));
    b.type = "button";
    b.textContent = text;
    b.setAttribute("aria-label", name);
    b.title = name;
    b.addEventListener("click", act);
  };

  // hands a file to whoever reads the page, and says so
  const save = (blob, name) => {
    const a = document.body.appendChild(document.createElement("a"));
    a.href = URL.createObjectURL(blob);
    a.download = name;
    a.click();
    a.remove();
    setTimeout(() => URL.revokeObjectURL(a.href), 1e4);
    heard.textContent = `${name} is saved`;
  };
  const named = (what, end) => `${document.title} ${what}`.replace(/[^\p{L}\p{N}.]+/gu, "_").replace(/^_+|_+$/g, "") + end;
  // a cell of a file of values: a text that a spreadsheet would take for a formula is none
  const cell = (v) => {
    const text = typeof v === "number" ? (Number.isFinite(v) ? String(v) : "") : /^[=+@]/.test(v) ? `'${v}` : v;
    return /[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text;
  };
  const csv = (rows) => new Blob([rows.map((r) => r.map(cell).join(",") + "\n").join("")], { type: "text/csv" });

  // the columns of a chart: name and numbers, NaN in a gap
  const columns = async (packed) => {
    const bytes = Uint8Array.from(atob(packed), (c) => c.charCodeAt(0));
    const text = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"))).text();
    return text.trimEnd().split("\n").map((line) => {
      const [name, power, order, list] = line.split("\t");
      const numbers = list.split(" ").map((w) => (w === "-" ? NaN : +w));
      for (let k = 0; k < +order; k += 1) {
        let sum = 0;
        numbers.forEach((v, i) => { if (!Number.isNaN(v)) numbers[i] = sum += v; });
      }
      return { name, values: numbers.map((v) => (Number.isNaN(v) ? NaN : +`${v}e${power}`)) };
    });
  };

  // what a picture of its own needs of the page's style
  const KEPT = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-dasharray", "stroke-linejoin", "stroke-linecap", "opacity", "font-family", "font-size", "font-weight", "text-anchor", "display"];
  const styled = (from, to) => {
    const style = getComputedStyle(from);
    for (const k of KEPT) to.style.setProperty(k, style.getPropertyValue(k));
    [...from.children].forEach((child, i) => styled(child, to.children[i]));
  };
  // dots of a picture for a px of the chart
  const FINE = 2;

  class Chart {
    constructor(svg) {
      this.svg = svg;
      this.figure = svg.closest("figure");
      this.plot = svg.querySelector(".plot");
      this.width = +this.plot.getAttribute("width");
      this.height = +this.plot.getAttribute("height");
      this.left = +this.plot.getAttribute("x");
      this.top = +this.plot.getAttribute("y");
      this.x = axis(svg.dataset.x);
      this.y = axis(svg.dataset.y);
      this.view = this.first = [this.x.low, this.x.high, this.y.low, this.y.high];
      this.log = svg.dataset.log !== undefined;
      this.link = svg.dataset.link || "";
      this.paths = [...this.plot.querySelectorAll("path[data-s]")];
      this.curve = this.paths.some((p) => p.dataset.along);
      this.plane = this.curve || this.paths.some((p) => p.classList.contains("marks"));
      this.at = null;
      this.names();
      this.tools();
      this.listen();
    }

    // points of every line, read when they are first needed
    lines() {
      this.read ||= this.paths.map((path) => ({ path, points: points(path) }));
      return this.read.filter((l) => !l.path.hasAttribute("hidden"));
    }

    names() {
      for (const li of this.figure.querySelectorAll(".keys li")) {
        const path = this.paths.find((p) => p.dataset.s === li.dataset.s);
        if (!path) continue;
        const button = document.createElement("button");
        button.type = "button";
        button.setAttribute("aria-pressed", "true");
        button.title = "Show or hide";
        button.append(...li.childNodes);
        button.addEventListener("click", () => this.toggle(path, button));
        li.append(button);
      }
    }

    toggle(path, button) {
      const shown = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", String(shown));
      const kind = path.getAttribute("class");
      for (const c of this.group()) {
        for (const p of c.paths) {
          if (p === path || (c !== this && !c.figure.querySelector(".keys") && p.getAttribute("class") === kind)) {
            p.toggleAttribute("hidden", !shown);
          }
        }
        c.clear();
      }
    }

    tools() {
      const below = this.figure.querySelector(".below");
      const box = document.createElement("div");
      box.className = "tools";
      if (!this.log) {
        const [least, most] = this.svg.dataset.whole.split(" ").map(Number);
        const span = this.x.high - this.x.low;
        this.whole = [this.x.low + least * span, this.x.low + most * span];
        // where charts share their names they share their zoom
        if (this.figure.querySelector(".keys")) {
          tool(box, "+", "Zoom in", () => this.zoom(0.5));
          tool(box, "\u2212", "Zoom out", () => this.zoom(2));
          if (most - least > 1.02) tool(box, "all", "The whole recording", () => this.show(this.whole));
          tool(box, "reset", "As at first", () => this.show(null));
        }
      }
      const label = this.svg.getAttribute("aria-label");
      tool(box, "PNG", `Picture: ${label}`, () => this.picture(label));
      const packed = below.dataset.points;
      if (packed && window.DecompressionStream) tool(box, "CSV", `Values: ${label}`, () => this.table(packed, label));
      below.append(box);
    }

    // the points as a file: columns side by side, rows that hold nothing left out
    async table(packed, label) {
      const all = await columns(packed);
      const rows = [all.map((c) => c.name)];
      for (let i = 0; i < Math.max(...all.map((c) => c.values.length)); i += 1) {
        const row = all.map((c) => (i < c.values.length ? c.values[i] : NaN));
        if (row.some((v) => !Number.isNaN(v))) rows.push(row);
      }
      save(csv(rows), named(label, ".csv"));
    }

    // the chart as it is shown, with title and names, on the page's paper
    picture(label) {
      this.clear();
      const { width, height } = this.svg.viewBox.baseVal;
      const style = getComputedStyle(document.body);
      const size = parseFloat(getComputedStyle(this.svg.querySelector("text")).fontSize);
      const pen = document.createElement("canvas").getContext("2d");
      pen.font = `${size}px ${style.fontFamily}`;
      const whole = document.createElementNS(NS, "svg");
      const write = (text, x, y, weight) => {
        const t = make("text", { x, y, fill: style.color, "font-family": style.fontFamily, "font-size": size, "font-weight": weight }, whole);
        t.textContent = text;
      };
      const margin = size, line = 1.7 * size;
      let [x, y] = [margin, margin + size];
      make("rect", { width: "100%", height: "100%", fill: style.backgroundColor }, whole);
      write(label, x, y, 600);
      y += line;
      const names = this.paths.filter((p) => !p.hasAttribute("hidden") && p.dataset.n);
      for (const path of names) {
        const long = 30 + pen.measureText(path.dataset.n).width + margin;
        if (x > margin && x + long > width + margin) [x, y] = [margin, y + line];
        const mark = path.classList.contains("marks") ? `M${x + 11},${y - 0.35 * size}${points(path)[0]?.mark ?? ""}` : `M${x + 1},${y - 0.35 * size}h20`;
        const piece = make("path", { d: mark }, whole);
        styled(path, piece);
        write(path.dataset.n, x + 30, y, 400);
        x += long;
      }
      const copy = this.svg.cloneNode(true);
      styled(this.svg, copy);
      y += 0.7 * size;
      for (const [k, v] of Object.entries({ x: margin, y, width, height })) copy.setAttribute(k, v);
      whole.append(copy);
      const [w, h] = [width + 2 * margin, y + height + margin];
      for (const [k, v] of Object.entries({ width: FINE * w, height: FINE * h, viewBox: `0 0 ${w} ${h}` })) whole.setAttribute(k, v);
      const image = new Image();
      image.addEventListener("load", () => {
        const canvas = document.createElement("canvas");
        [canvas.width, canvas.height] = [FINE * w, FINE * h];
        canvas.getContext("2d").drawImage(image, 0, 0);
        canvas.toBlob((blob) => save(blob, named(label, ".png")), "image/png");
      });
      image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(new XMLSerializer().serializeToString(whole))}`;
    }

    group() {
      return this.link ? charts.filter((c) => c.link === this.link) : [this];
    }

    // px of the plot under a pointer
    px(event) {
      const r = this.plot.ownerSVGElement.getBoundingClientRect();
      const scale = r.width / this.svg.viewBox.baseVal.width;
      return [(event.clientX - r.left) / scale - this.left, (event.clientY - r.top) / scale - this.top];
    }

    valueX(px) { return this.view[0] + (px / this.width) * (this.view[1] - this.view[0]); }
    valueY(px) { return this.view[3] - (px / this.height) * (this.view[3] - this.view[2]); }
    // where a point drawn at first now lies
    now(p) {
      const f = this.first;
      const x = f[0] + (p.x / this.width) * (f[1] - f[0]);
      const y = f[3] - (p.y / this.height) * (f[3] - f[2]);
      const v = this.view;
      return { ...p, vx: x, vy: y, x: (this.width * (x - v[0])) / (v[1] - v[0]), y: (this.height * (v[3] - y)) / (v[3] - v[2]) };
    }

    listen() {
      const s = this.svg;
      s.setAttribute("tabindex", "0");
      s.querySelector("title").remove(); // the label says it; a tip would hide the line
      s.addEventListener("pointermove", (e) => this.move(e));
      s.addEventListener("pointerdown", (e) => this.press(e));
      s.addEventListener("pointerup", (e) => this.release(e));
      s.addEventListener("pointerleave", () => { if (this.from === undefined) this.group().forEach((c) => c.clear()); });
      s.addEventListener("dblclick", () => { if (!this.log) this.show(null); });
      s.addEventListener("keydown", (e) => this.key(e));
      s.addEventListener("blur", () => this.group().forEach((c) => c.clear()));
    }

    move(event) {
      const [x, y] = this.px(event);
      if (this.from !== undefined) return this.mark(x);
      if (x < 0 || x > this.width) return;
      this.point(x, y);
    }

    // the cursor at a place of the plot, here and in linked charts
    point(x, y) {
      if (!this.plane) return this.put(this.valueX(x));
      let best = null;
      for (const line of this.lines()) {
        line.points.forEach((p, i) => {
          const n = this.now(p);
          const d = Math.hypot(n.x - x, n.y - y);
          if (!best || d < best.d) best = { d, i, line, along: p.along, vx: n.vx };
        });
      }
      if (!best) return;
      this.at = { line: best.line, i: best.i };
      this.put(this.curve ? best.along : best.vx);
    }

    put(value) {
      this.value = value;
      const said = this.group().map((c) => c.cursor(value));
      return said[this.group().indexOf(this)];
    }

    // draws the cursor at a value of x, or of what runs along the curve; returns it in words
    cursor(value) {
      const old = this.plot.querySelector(".cursor");
      if (old) old.remove();
      const g = make("g", { class: "cursor" }, this.plot);
      const said = [];
      const rows = [];
      let mean = 0;
      for (const line of this.lines()) {
        const at = this.nearest(line, value);
        if (!at) continue;
        make("circle", { cx: at.x, cy: at.y, r: 3.5 }, g);
        const text = `${digits(this.log ? 10 ** at.vy : at.vy * this.y.factor)} ${this.y.unit}`.trim();
        said.push(`${line.path.dataset.n} ${text}`);
        rows.push([line.path, line.path.dataset.n, text]);
        mean += at.x;
      }
      if (!this.curve) {
        const x = (this.width * (value - this.view[0])) / (this.view[1] - this.view[0]);
        make("line", { x1: x, x2: x, y1: 0, y2: this.height }, g);
        const shown = `${digits(this.log ? 10 ** value : value * this.x.factor)} ${this.x.unit}`.trim();
        this.readout(x, [[null, this.svg.querySelector(".name.end")?.textContent.split(",")[0] || "at", shown], ...rows]);
        return `${shown}: ${said.join(", ")}`;
      }
      this.readout(rows.length ? mean / rows.length : 0, rows);
      return said.join(", ");
    }

    // the values under the cursor, in a box on the other side of the plot
    readout(x, rows) {
      if (!this.box) {
        this.box = document.createElement("div");
        this.box.className = "readout";
        this.box.setAttribute("aria-hidden", "true");
        this.figure.append(this.box);
      }
      this.box.hidden = rows.length === 0;
      this.box.replaceChildren(...rows.map(([path, name, text]) => {
        const row = document.createElement("div");
        if (path) {
          const piece = make("svg", { class: "piece", viewBox: "0 0 22 10" }, row);
          make("path", { class: path.getAttribute("class"), d: path.classList.contains("marks") ? `M11,5${points(path)[0].mark}` : "M1,5H21" }, piece);
        }
        const value = document.createElement("b");
        value.textContent = text;
        row.append(name, value);
        return row;
      }));
      const svg = this.svg.getBoundingClientRect();
      const scale = svg.width / this.svg.viewBox.baseVal.width;
      const within = (this.box.offsetParent || document.body).getBoundingClientRect();
      const left = x > this.width / 2 ? this.left + 6 : this.left + this.width - 6 - this.box.offsetWidth / scale;
      this.box.style.left = `${svg.left - within.left + left * scale}px`;
      this.box.style.top = `${svg.top - within.top + (this.top + 4) * scale}px`;
    }

    nearest(line, value) {
      const all = line.points;
      if (!all.length) return null;
      if (this.curve || this.plane) {
        const of = (p) => (this.curve ? p.along : this.now(p).vx);
        let best = all[0];
        for (const p of all) if (Math.abs(of(p) - value) < Math.abs(of(best) - value)) best = p;
        if (this.plane && !this.curve && Math.abs(of(best) - value) > 1e-3 * (this.view[1] - this.view[0])) return null;
        return this.now(best);
      }
      const f = this.first;
      const x = (this.width * (value - f[0])) / (f[1] - f[0]);
      let a = 0, b = all.length - 1;
      if (x < all[0].x || x > all[b].x) return null;
      while (b - a > 1) {
        const m = (a + b) >> 1;
        if (all[m].x <= x) a = m; else b = m;
      }
      const p = all[a], q = all[b];
      if (q.gap && b > a) return null;
      const u = q.x > p.x ? (x - p.x) / (q.x - p.x) : 0;
      return this.now({ ...p, x, y: p.y + u * (q.y - p.y) });
    }

    clear() {
      const old = this.plot.querySelector(".cursor");
      if (old) old.remove();
      if (this.box) this.box.hidden = true;
    }

    press(event) {
      if (event.pointerType !== "mouse" || event.button !== 0 || this.log) return;
      this.from = this.px(event)[0];
      this.svg.setPointerCapture(event.pointerId);
      event.preventDefault();
      this.svg.focus({ preventScroll: true });
    }

    mark(x) {
      const old = this.plot.querySelector(".cursor");
      if (old) old.remove();
      const g = make("g", { class: "cursor" }, this.plot);
      const [a, b] = [Math.min(x, this.from), Math.max(x, this.from)];
      make("rect", { x: a, y: 0, width: Math.max(0, b - a), height: this.height }, g);
    }

    release(event) {
      if (this.from === undefined) return;
      const [a, b] = [this.from, this.px(event)[0]].sort((p, q) => p - q);
      this.from = undefined;
      this.clear();
      if (b - a > 6) this.show([this.valueX(Math.max(0, a)), this.valueX(Math.min(this.width, b))]);
    }

    zoom(by) {
      const [a, b] = this.view;
      const middle = this.value > a && this.value < b && !this.plane ? this.value : (a + b) / 2;
      const low = middle - (middle - a) * by, high = middle + (b - middle) * by;
      this.show([Math.max(low, Math.min(a, this.whole[0])), Math.min(high, Math.max(b, this.whole[1]))]);
    }

    // shows a part of x, here and in linked charts over the same axis; null: as at first
    show(part) {
      for (const c of this.group()) {
        if (c === this || (!c.plane && !this.plane)) c.see(part);
        c.clear();
      }
    }

    see(part) {
      this.view = this.first;
      if (part && part[1] > part[0]) {
        let low = Infinity, high = -Infinity;
        for (const line of this.lines()) {
          for (const p of line.points) {
            const n = this.now(p);
            if (n.vx < part[0] || n.vx > part[1]) continue;
            low = Math.min(low, n.vy);
            high = Math.max(high, n.vy);
          }
        }
        const pad = high > low ? 0.05 * (high - low) : 0.5 * (Math.abs(high) || 1);
        this.view = high >= low ? [part[0], part[1], low - pad, high + pad] : [part[0], part[1], this.first[2], this.first[3]];
      }
      this.draw();
    }

    draw() {
      this.bands ||= [...this.plot.querySelectorAll(".band")].map((path) => ({ path, points: points(path) }));
      this.lines();
      for (const { path, points: all } of [...this.read, ...this.bands]) {
        path.setAttribute("d", all.map((p) => {
          const n = this.now(p);
          return `${p.gap ? "M" : "L"}${n.x.toFixed(2)},${n.y.toFixed(2)}${p.mark}`;
        }).join(""));
      }
      this.ticks();
    }

    ticks() {
      const low = this.top + this.height;
      const grid = this.svg.querySelector(".grid"), base = grid.querySelector(".base");
      const [gx, gy] = [this.svg.querySelector("g.x"), this.svg.querySelector("g.y")];
      for (const g of [grid, gx, gy]) g.replaceChildren();
      for (const [v, text] of round(this.view[2] * this.y.factor, this.view[3] * this.y.factor, Math.max(3, Math.floor(this.height / 36)))) {
        const y = low - (this.height * (v / this.y.factor - this.view[2])) / (this.view[3] - this.view[2]);
        make("path", { d: `M${this.left},${y}h${this.width}` }, grid);
        make("text", { x: this.left - 8, y, dy: ".35em" }, gy).textContent = text;
      }
      for (const [v, text] of round(this.view[0] * this.x.factor, this.view[1] * this.x.factor, Math.floor(this.width / 66))) {
        const x = this.left + (this.width * (v / this.x.factor - this.view[0])) / (this.view[1] - this.view[0]);
        make("path", { d: `M${x},${low}v4` }, grid);
        make("text", { x, y: low + 17 }, gx).textContent = text;
      }
      grid.append(base);
    }

    key(event) {
      const step = (event.shiftKey ? 0.1 : 0.01) * (this.view[1] - this.view[0]);
      const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      let said;
      if (way && this.plane) said = this.step(way * (event.shiftKey ? 10 : 1));
      else if (way) said = this.put(this.inside((this.value ?? (this.view[0] + this.view[1]) / 2) + way * step));
      else if (event.key === "Home") said = this.put(this.view[0]);
      else if (event.key === "End") said = this.put(this.view[1]);
      else if (event.key === "Escape") this.group().forEach((c) => c.clear());
      else if (!this.log && event.key === "+") this.zoom(0.5);
      else if (!this.log && event.key === "-") this.zoom(2);
      else if (!this.log && event.key === "0") this.show(null);
      else return;
      event.preventDefault();
      if (said) heard.textContent = said;
    }

    inside(v) { return Math.min(this.view[1], Math.max(this.view[0], v)); }

    // to the next point of the line under the cursor
    step(by) {
      const lines = this.lines();
      if (!lines.length) return "";
      const line = this.at && lines.includes(this.at.line) ? this.at.line : lines[0];
      const i = Math.max(0, Math.min(line.points.length - 1, (this.at?.line === line ? this.at.i : 0) + by));
      this.at = { line, i };
      return this.put(this.curve ? line.points[i].along : this.now(line.points[i]).vx);
    }
  }

  // round numbers between two, with their texts
  const round = (low, high, most) => {
    const raw = (high - low) / most;
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw * (1 - 1e-9));
    const decimals = Math.max(0, Math.min(9, -Math.floor(Math.log10(step))));
    const all = [];
    for (let i = Math.ceil(low / step); i * step <= high && all.length < 20; i += 1) {
      all.push([i * step, minus((i === 0 ? 0 : i * step).toFixed(decimals))]);
    }
    return all;
  };

  // text of one size on screen, whatever the width of its chart
  const sizes = new ResizeObserver((all) => {
    for (const { target } of all) {
      const width = target.getBoundingClientRect().width;
      const scale = width / target.viewBox.baseVal.width;
      if (width) target.style.setProperty("--f", `${((scale < 0.7 ? 10.5 : 11.5) / scale).toFixed(2)}px`);
    }
  });

  // a table as a file: numbers in SI with all their digits, their units in the head or, where they differ, in a column of their own
  const tabled = (table) => {
    const heads = [...table.tHead.rows[0].cells];
    const body = [...table.tBodies[0].rows].map((r) => [...r.cells]);
    const out = [[], ...body.map(() => [])];
    heads.forEach((th, k) => {
      const cells = body.map((r) => r[k]);
      const name = th.dataset.n ?? th.innerText.replace(/\s+/g, " ").trim();
      const unit = th.dataset.u ? ` [${th.dataset.u}]` : "";
      const ends = cells.some((c) => c?.dataset.v?.includes(" "));
      const own = cells.some((c) => c?.dataset.u);
      const of = (text) => (text === "" ? "" : Number.isNaN(+text) ? text : +text);
      const text = (c) => (c?.dataset.v === undefined ? c?.innerText.trim() ?? "" : of(c.dataset.v));
      if (ends) {
        out[0].push(`${name}, low${unit}`, `${name}, high${unit}`);
        cells.forEach((c, i) => {
          const pair = c?.dataset.v?.split(" ");
          out[i + 1].push(...(pair ? [of(pair[0]), of(pair[1] ?? "")] : [text(c), ""]));
        });
      } else {
        out[0].push(name + unit);
        cells.forEach((c, i) => out[i + 1].push(text(c)));
      }
      if (own) {
        out[0].push(`${name}, unit`);
        cells.forEach((c, i) => out[i + 1].push(c?.dataset.u ?? ""));
      }
    });
    return out;
  };
  for (const table of document.querySelectorAll("main table")) {
    const scroll = table.closest(".scroll");
    if (!scroll || table.closest(".data") || !table.tHead) continue;
    const label = table.caption?.innerText ?? scroll.getAttribute("aria-label");
    let h = scroll;
    while (h && h.tagName !== "H2") h = h.previousElementSibling ?? h.parentElement;
    const full = h && h.innerText !== label ? `${h.innerText}, ${label}` : label;
    const box = document.createElement("div");
    box.className = "tools of-table";
    tool(box, "CSV", `Values: ${full}`, () => save(csv(tabled(table)), named(full, ".csv")));
    scroll.after(box);
  }

  const charts = [];
  for (const svg of document.querySelectorAll("svg.chart")) {
    charts.push(new Chart(svg));
    sizes.observe(svg);
  }
})();
