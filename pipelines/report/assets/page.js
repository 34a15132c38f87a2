"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const plots = new Map(); // key of a chart -> its uPlots
  const groups = new Map(); // group -> {charts, range}
  const PANEL_PX = 190, LOWER_PX = 130;
  // On paper: wide, in one of two columns, and there in a card; what is drawn wider makes the browser shrink the page.
  const PRINT_PX = { wide: 660, half: 335, card: 308 }, PRINT_SHARE = 0.7;

  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();

  function numbers(coded, type) {
    const bytes = Uint8Array.from(atob(coded), (c) => c.charCodeAt(0));
    return new type(bytes.buffer);
  }
  // uPlot draws a gap where a value is null; NaN it would join over.
  // A mean's curve goes on over rows that are not its own (undefined).
  function column(curve) {
    const values = numbers(curve.values, Float32Array), none = curve.mark === "mean" ? undefined : null;
    return values.every(Number.isFinite) ? values : Array.from(values, (v) => (Number.isFinite(v) ? v : none));
  }
  const shown = (v) => (v == null ? "" : Math.abs(v) >= 1e5 || (v !== 0 && Math.abs(v) < 1e-3) ? v.toExponential(2) : String(+v.toPrecision(4)));

  function element(tag, className, text) {
    const made = document.createElement(tag);
    if (className) made.className = className;
    if (text !== undefined) made.textContent = text;
    return made;
  }

  const WIDTHS = { measured: 1, wanted: 1, before: 2.2, after: 1.3 };
  function seriesOf(curve) {
    const stroke = () => css(curve.role);
    const points = { show: curve.mark === "dots", size: 2.6, width: 0, stroke, fill: () => css(curve.role) + (curve.mark === "dots" ? "88" : "") };
    return {
      label: curve.label, stroke, points, spanGaps: false,
      width: curve.mark === "mean" ? 2.4 : WIDTHS[curve.role],
      ...(curve.mark === "dots" ? { paths: () => null } : {}),
    };
  }

  function drawBand(u, half) {
    const { ctx } = u, { left, width } = u.bbox;
    const top = u.valToPos(half, "y", true), bottom = u.valToPos(-half, "y", true);
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, u.bbox.top, width, u.bbox.height);
    ctx.clip();
    ctx.fillStyle = css("noise");
    ctx.fillRect(left, top, width, bottom - top);
    ctx.restore();
  }

  // A panel that has nothing to show in a stretch keeps its scale and so its axis, or it would grow wider than the others.
  function lasting() {
    let known = [-1, 1];
    return (u, low, high) => {
      if (low != null && high != null) known = uPlot.rangeNum(low, high, 0.1, true);
      return known;
    };
  }

  function axes(xLabel, last) {
    const font = "12px system-ui, sans-serif";
    const common = { stroke: () => css("ink-2"), font, grid: { stroke: () => css("grid"), width: 1 }, ticks: { show: false } };
    return [
      { ...common, size: last ? 26 : 6, ...(last ? { label: xLabel, labelSize: 18, labelFont: font, labelGap: 0 } : {}), values: (u, all) => all.map((v) => (last && v != null ? String(+v.toPrecision(7)) : "")) },
      { ...common, size: 58, values: (u, all) => all.map((v) => (v == null ? "" : String(+v.toPrecision(7)))) },
    ];
  }

  function panelLegend(panel, chart) {
    const line = element("div", "panel-label");
    line.append(element("span", "", panel.label));
    const outputs = panel.series.map((curve) => {
      if (!curve.label) return null;
      const item = element("span", `key line ${curve.role}`, curve.label);
      const output = element("output");
      item.append(output);
      line.append(item);
      return output;
    });
    if (panel.band) line.append(element("span", "key noise", "noise floor"));
    return [line, outputs];
  }

  function spread(group, from, min, max) {
    if (group.busy) return;
    group.busy = true;
    group.range = [min, max];
    for (const key of group.charts) for (const u of plots.get(key) || []) if (u !== from) u.setScale("x", { min, max });
    group.busy = false;
  }

  function draw(figure) {
    const key = figure.dataset.chart, chart = data.charts[key];
    if (!chart || plots.has(key)) return;
    const place = figure.querySelector(".plot"), x = numbers(chart.x, Float64Array);
    place.textContent = "";
    const name = chart.group || key;
    if (!groups.has(name)) groups.set(name, { charts: new Set(), range: null, busy: false });
    const group = groups.get(name), made = [];
    plots.set(key, made);
    group.charts.add(key);
    chart.panels.forEach((panel, i) => {
      const last = i === chart.panels.length - 1;
      const [legend, outputs] = panelLegend(panel, chart);
      const box = element("div");
      place.append(legend, box);
      const u = new uPlot({
        width: Math.max(place.clientWidth, 220),
        height: (i && chart.group ? LOWER_PX : PANEL_PX) + (last ? 36 : 0),
        legend: { show: false },
        cursor: { sync: { key: name, setSeries: false }, drag: { x: true, y: false }, points: { size: 6 } },
        scales: { x: { time: false }, y: { range: panel.reach ? () => [-panel.reach, panel.reach] : lasting() } },
        axes: axes(chart.x_label, last),
        series: [{}, ...panel.series.map(seriesOf)],
        hooks: {
          drawClear: panel.band ? [(self) => drawBand(self, panel.band)] : [],
          setScale: [(self, scale) => scale === "x" && self.status === 1 && spread(group, self, self.scales.x.min, self.scales.x.max)],
          setCursor: [(self) => outputs.forEach((output, k) => {
            if (output) output.textContent = self.cursor.idx == null ? "" : shown(self.data[k + 1][self.cursor.idx]);
          })],
        },
      }, [x, ...panel.series.map(column)], box);
      u.onScreen = u.height;
      made.push(u);
    });
    if (group.range) made.forEach((u) => u.setScale("x", { min: group.range[0], max: group.range[1] }));
  }

  function zoom(name, factor, shift) {
    const group = groups.get(name);
    if (!group || !group.charts.size) return;
    const u = plots.get([...group.charts][0])[0], all = u.data[0];
    const first = all[0], last = all[all.length - 1];
    let { min, max } = u.scales.x;
    if (factor === 0) [min, max] = [first, last];
    else {
      const half = Math.min((max - min) * factor, last - first) / 2, middle = (min + max) / 2 + shift * (max - min);
      const place = Math.min(Math.max(middle, first + half), last - half);
      [min, max] = [place - half, place + half];
    }
    u.setScale("x", { min, max });
  }
  const TOOLS = [["◀", "earlier", 1, -0.5], ["−", "show more", 2, 0], ["whole", "show the whole run", 0, 0], ["+", "show less", 0.5, 0], ["▶", "later", 1, 0.5]];
  for (const bar of document.querySelectorAll("[data-zoom]")) {
    for (const [text, title, factor, shift] of TOOLS) {
      const button = element("button", "", text);
      button.type = "button";
      button.title = button.ariaLabel = title;
      button.addEventListener("click", () => zoom(bar.dataset.zoom, factor, shift));
      bar.append(button);
    }
    bar.append(element("span", "", "or drag over a chart to zoom, double-click to see all"));
  }

  const figures = [...document.querySelectorAll("[data-chart]")];
  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries) if (entry.isIntersecting) { seen.unobserve(entry.target); draw(entry.target); }
  }, { rootMargin: "600px 0px" });
  figures.forEach((figure) => seen.observe(figure));

  function fit() {
    for (const figure of figures) {
      const place = figure.querySelector(".plot");
      for (const u of plots.get(figure.dataset.chart) || []) {
        const wanted = place.clientWidth;
        if (wanted > 0 && (u.width !== wanted || u.height !== u.onScreen)) u.setSize({ width: wanted, height: u.onScreen });
      }
    }
  }
  // A plot that has not been drawn yet has no scale to redraw at; it will take the colours that there are.
  // Axes are laid out again too: without, uPlot forgets that a plot has just been given another size.
  const redraw = () => { for (const made of plots.values()) for (const u of made) if (u.status === 1) u.redraw(true, true); for (const stage of stages) stage.draw(); };
  new ResizeObserver(() => fit()).observe(document.querySelector("main"));
  for (const details of document.querySelectorAll("details")) details.addEventListener("toggle", () => fit());
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);

  let closed = [];
  addEventListener("beforeprint", () => {
    document.documentElement.dataset.theme = "light";
    closed = [...document.querySelectorAll("details:not([open])")].filter((d) => !d.hasAttribute("data-screen-only"));
    closed.forEach((details) => { details.open = true; });
    figures.forEach(draw);
    for (const figure of figures) for (const u of plots.get(figure.dataset.chart) || []) {
      const place = figure.closest(".grid, .hero") ? "card" : figure.closest(".charts") ? "half" : "wide";
      u.setSize({ width: PRINT_PX[place], height: PRINT_SHARE * u.height });
    }
    redraw();
  });
  addEventListener("afterprint", () => {
    delete document.documentElement.dataset.theme;
    closed.forEach((details) => { details.open = false; });
    fit();
    redraw();
  });

  // The machine in motion.
  const LINE_PX = { measured: 14, before: 7, after: 3 };
  class Stage {
    constructor(box, motion) {
      this.motion = motion;
      this.time = numbers(motion.time, Float64Array);
      this.joints = motion.lengths.length;
      this.moves = Object.entries(motion.angles).map(([role, coded]) => [role, numbers(coded, Float32Array)]);
      this.canvas = box.querySelector("canvas");
      this.slider = box.querySelector("input");
      this.button = box.querySelector("button");
      this.clock = box.querySelector("output");
      this.times = box.querySelector("select");
      this.slider.max = this.time.length - 1;
      this.slider.addEventListener("input", () => { this.stop(); this.at = +this.slider.value; this.draw(); });
      this.times.addEventListener("change", () => this.draw());
      this.button.addEventListener("click", () => (this.running ? this.stop() : this.start()));
      this.at = this.furthestOff();
      this.running = false;
      new ResizeObserver(() => this.draw()).observe(this.canvas);
    }
    furthestOff() {
      const [[, measured], [, first] = [null, measured]] = this.moves;
      let at = 0;
      measured.forEach((value, k) => { if (Math.abs(first[k] - value) > Math.abs(first[at] - measured[at])) at = k; });
      return Math.floor(at / this.joints);
    }
    start() {
      this.running = true;
      this.button.textContent = "Pause";
      if (this.at >= this.time.length - 1) this.at = 0;
      const began = performance.now() - 1e3 * (this.time[Math.floor(this.at)] - this.time[0]);
      const step = (now) => {
        if (!this.running) return;
        const t = this.time[0] + 1e-3 * (now - began);
        while (this.at < this.time.length - 1 && this.time[this.at + 1] <= t) this.at++;
        if (this.at >= this.time.length - 1) return this.stop();
        this.draw();
        requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }
    stop() {
      this.running = false;
      this.button.textContent = "Play";
      this.draw();
    }
    angles(values) {
      const k = Math.floor(this.at) * this.joints, measured = this.moves[0][1], times = +this.times.value;
      return Array.from({ length: this.joints }, (_, j) => measured[k + j] + times * (values[k + j] - measured[k + j]));
    }
    draw() {
      const { canvas, motion } = this, scale = devicePixelRatio || 1;
      const width = canvas.clientWidth, height = canvas.clientHeight;
      if (!width) return;
      canvas.width = width * scale;
      canvas.height = height * scale;
      const ctx = canvas.getContext("2d");
      ctx.scale(scale, scale);
      ctx.lineCap = ctx.lineJoin = "round";
      for (const [role, values] of this.moves) {
        ctx.strokeStyle = ctx.fillStyle = css(role);
        ctx.lineWidth = LINE_PX[role];
        const points = motion.kind === "slider" ? this.slide(values, width, height) : this.hang(values, width, height);
        ctx.beginPath();
        points.forEach(([x, y], i) => (i ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
        ctx.stroke();
        for (const [x, y] of points) { ctx.beginPath(); ctx.arc(x, y, LINE_PX[role] / 2 + 2, 0, 7); ctx.fill(); }
      }
      if (+this.times.value !== 1) {
        ctx.fillStyle = css("ink");
        ctx.font = "600 13px system-ui, sans-serif";
        ctx.fillText(`difference from measured drawn × ${this.times.value}`, 12, height - 12);
      }
      this.slider.value = Math.floor(this.at);
      this.clock.textContent = this.time[Math.floor(this.at)].toFixed(2) + " s";
    }
    hang(values, width, height) {
      const [left, right, up, down] = this.reached(), room = 26;
      const size = Math.min((height - 2 * room) / (up + down), (width - 2 * room) / (left + right));
      let x = 0.5 * (width + size * (left - right)), y = room + 0.5 * (height - 2 * room + size * (up - down)), angle = 0;
      const points = [[x, y]];
      this.angles(values).forEach((q, j) => {
        angle += q;
        x += size * this.motion.lengths[j] * Math.sin(angle);
        y += size * this.motion.lengths[j] * Math.cos(angle);
        points.push([x, y]);
      });
      return points;
    }
    // How far the links go to either side of the pivot, above and below it, in the whole motion as it is drawn now.
    reached() {
      const times = +this.times.value;
      if (this.reach && this.reach.times === times) return this.reach.box;
      const box = [0.2, 0.2, 0.05, 0.05], measured = this.moves[0][1];
      for (const [, values] of this.moves) for (let k = 0; k < values.length; k += this.joints) {
        let x = 0, y = 0, angle = 0;
        for (let j = 0; j < this.joints; j++) {
          angle += measured[k + j] + times * (values[k + j] - measured[k + j]);
          x += this.motion.lengths[j] * Math.sin(angle);
          y += this.motion.lengths[j] * Math.cos(angle);
          box[0] = Math.max(box[0], -x); box[1] = Math.max(box[1], x); box[2] = Math.max(box[2], -y); box[3] = Math.max(box[3], y);
        }
      }
      this.reach = { times, box };
      return box;
    }
    slide(values, width, height) {
      const x = width * (0.5 + 0.42 * this.angles(values)[0] / this.motion.lengths[0]);
      return [[x, 0.3 * height], [x, 0.7 * height]];
    }
  }
  const stages = [...document.querySelectorAll("[data-stage]")].map((box) => new Stage(box, data.animations[+box.dataset.stage]));

  for (const button of document.querySelectorAll("[data-copy]")) {
    button.addEventListener("click", async () => {
      await navigator.clipboard.writeText(document.getElementById(button.dataset.copy).textContent);
      button.textContent = "Copied";
    });
  }

  // For tests, and whoever wants the numbers.
  window.exoid = { data, plots, zoom, numbers, drawAll: () => figures.forEach(draw) };
})();
