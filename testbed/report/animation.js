(() => {
  const root = document.getElementById("moving"), canvas = root.querySelector("canvas.screen");
  const A = JSON.parse(document.getElementById("frames").textContent), F = A.frames;
  const button = root.querySelector("button"), slider = root.querySelector("input"), out = root.querySelector("output");
  const screen = canvas.getContext("2d"), legs = ["fl", "fr", "rl", "rr"];
  const colours = ["#0072b2", "#d55e00", "#009e73", "#a5528a"];
  const S = A.size, tilt = A.slope * Math.PI / 180, pace = F.length > 1 ? (F[F.length - 1][0] - F[0][0]) / (F.length - 1) : 100;
  const speed = Math.max(1, Math.min(10, F.length * pace / 30000));
  let k = 0, yaw = -1.05, lift = 0.42, playing = false, last = 0, clock = 0, drag = null, cx = screen, W = 0, H = 0, scale = 1, eye;
  slider.max = F.length - 1;
  const vec = (f, i) => [f[i], f[i + 1], f[i + 2]];
  const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  // Slope frame -> world (gravity down) -> seen from yaw and lift, in pixels.
  function project(p) {
    const x = p[0] - eye[0], y = p[1] - eye[1], z = p[2] - eye[2];
    const wx = x * Math.cos(tilt) - z * Math.sin(tilt), wz = x * Math.sin(tilt) + z * Math.cos(tilt);
    const sx = wx * Math.cos(yaw) - y * Math.sin(yaw), depth = wx * Math.sin(yaw) + y * Math.cos(yaw);
    return [W / 2 + scale * sx, H * 0.56 - scale * (wz * Math.cos(lift) - depth * Math.sin(lift) * -1)];
  }
  function line(points, colour, width) {
    cx.strokeStyle = colour; cx.lineWidth = width; cx.beginPath();
    points.forEach((p, i) => { const q = project(p); if (i) cx.lineTo(q[0], q[1]); else cx.moveTo(q[0], q[1]); });
    cx.stroke();
  }
  function arrow(from, way, colour) {
    const a = project(from), b = project(add(from, way)), l = Math.hypot(b[0] - a[0], b[1] - a[1]);
    if (l < 3) return;
    const u = [(b[0] - a[0]) / l, (b[1] - a[1]) / l], h = Math.min(9, l * 0.5);
    line([from, add(from, way)], colour, 3);
    cx.fillStyle = colour; cx.beginPath(); cx.moveTo(b[0] + u[0] * 2, b[1] + u[1] * 2);
    cx.lineTo(b[0] - u[0] * h - u[1] * h * 0.5, b[1] - u[1] * h + u[0] * h * 0.5);
    cx.lineTo(b[0] - u[0] * h + u[1] * h * 0.5, b[1] - u[1] * h - u[0] * h * 0.5); cx.fill();
  }
  function ground() {
    if (typeof A.ground === "number") plane(A.ground); else rock(A.ground);
  }
  function plane(z) {
    const step = 500 * S, cx0 = Math.round(eye[0] / step) * step, cy0 = Math.round(eye[1] / step) * step;
    for (let i = -6; i <= 6; i++) {
      line([[cx0 + i * step, cy0 - 6 * step, z], [cx0 + i * step, cy0 + 6 * step, z]], "#d9dce1", 1);
      line([[cx0 - 6 * step, cy0 + i * step, z], [cx0 + 6 * step, cy0 + i * step, z]], "#d9dce1", 1);
    }
  }
  function rock(g) {
    const n = g.columns, m = g.heights.length / n;
    const point = (i, j) => [g.corner[0] + i * g.cell, g.corner[1] + j * g.cell, g.heights[i * n + j]];
    const range = (k) => [...Array(k).keys()];
    for (const i of range(m)) line(range(n).map(j => point(i, j)), "#c9cdd4", 1);
    for (const j of range(n)) line(range(m).map(i => point(i, j)), "#c9cdd4", 1);
  }
  function label(text, p, colour) {
    const q = project(p); cx.font = "bold 13px system-ui, sans-serif"; cx.textAlign = "center";
    cx.strokeStyle = "#fff"; cx.lineWidth = 4; cx.strokeText(text, q[0], q[1]);
    cx.fillStyle = colour; cx.fillText(text, q[0], q[1]);
  }
  function draw(f) {
    const o = vec(f, 1), ex = vec(f, 4).map(v => v / 1000), ez = vec(f, 7).map(v => v / 1000), ey = cross(ez, ex);
    const at = p => add(add(add(o, ex, p[0]), ey, p[1]), ez, p[2]);
    eye = [o[0] + 150 * S, o[1] * 0.5, o[2] + 300 * S];
    cx.clearRect(0, 0, W, H); cx.lineCap = cx.lineJoin = "round";
    ground();
    const b = A.box, c = [];
    for (const x of [-b[0], b[0]]) for (const y of [-b[1], b[1]]) for (const z of [-b[2], b[2]]) c.push(at([x, y, z]));
    for (const [i, j] of [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]])
      line([c[i], c[j]], "#3d434c", 2);
    if (A.mast) {
      const m = A.mast, foot = at([m[0], m[1], m[2]]), top = at([m[0], m[1], m[2] + m[3]]);
      line([foot, top], "#c77800", 3);
      if (f[41] > 0) line([foot, at([m[0], m[1], m[2] - (f[41] + 350 * S)])], "#8a8f98", 3);
      if (Math.abs(f[40]) > 5) arrow(foot, ez.map(v => v * f[40] * 0.5 * S), "#6b7078");
    }
    const names = [];
    for (let i = 0; i < 4; i++) {
      const p = vec(f, 10 + 3 * i), hip = at([A.hips[3 * i], A.hips[3 * i + 1], A.hips[3 * i + 2]]);
      const d = add(p, o, -1), height = d[0] * ez[0] + d[1] * ez[1] + d[2] * ez[2];
      const knee = add(p, ez, A.hips[3 * i + 2] - height);
      line([hip, knee], "#5b616b", 4); line([add(knee, ez, 450 * S), p], "#5b616b", 4);
      const ring = []; for (let a = 0; a <= 12; a++) ring.push(add(add(p, ex, 150 * S * Math.cos(a * Math.PI / 6)), ey, 150 * S * Math.sin(a * Math.PI / 6)));
      line(ring, "#3d434c", 2);
      arrow(p, vec(f, 22 + 3 * i).map(v => v * 0.5 * S), colours[i]);
      names.push([legs[i], add(knee, ez, 560 * S), colours[i]]);
    }
    for (let i = 0; i < 2; i++) {
      const pull = vec(f, 34 + 3 * i), size = Math.hypot(...pull);
      if (size < 1) continue;
      const s = at([A.sheaves[3 * i], A.sheaves[3 * i + 1], A.sheaves[3 * i + 2]]);
      line([s, add(s, pull, 4000 * S / size)], "#1a1a1a", 0.7 + size / 700);
    }
    for (const [text, p, colour] of names) label(text, p, colour);
  }
  function show() {
    draw(F[k]);
    out.textContent = (F[k][0] / 1000).toFixed(1) + " s";
    slider.value = k;
  }
  // Three moments for paper, each as wide as high by its own attributes, whatever the page does to it.
  function stills() {
    document.querySelectorAll(".still").forEach((still, i) => {
      const f = F[Math.round(i * (F.length - 1) / 2)], c = still.querySelector("canvas");
      cx = c.getContext("2d"); W = c.width / 2; H = c.height / 2; scale = Math.min(W, H * 1.3) / (5400 * S);
      cx.setTransform(2, 0, 0, 2, 0, 0); draw(f);
      still.querySelector("figcaption").textContent = (f[0] / 1000).toFixed(1) + " s";
    });
    cx = screen;
  }
  function size() {
    const ratio = window.devicePixelRatio || 1;
    W = canvas.clientWidth; H = Math.round(Math.min(W * 0.72, 520));
    canvas.width = W * ratio; canvas.height = H * ratio; canvas.style.height = H + "px";
    cx.setTransform(ratio, 0, 0, ratio, 0, 0); scale = Math.min(W, H * 1.3) / (5400 * S); show();
  }
  function tick(now) {
    if (!playing) return;
    clock += Math.min(now - last, 200) * speed; last = now;
    k = Math.floor(clock / pace);
    if (k >= F.length) { k = F.length - 1; stop(); }
    show();
    if (playing) requestAnimationFrame(tick);
  }
  function stop() { playing = false; button.innerHTML = "&#9654;"; }
  button.onclick = () => {
    if (playing) return stop();
    if (k >= F.length - 1) k = 0;
    playing = true; clock = k * pace; last = performance.now(); button.innerHTML = "&#10073;&#10073;"; requestAnimationFrame(tick);
  };
  slider.oninput = () => { k = +slider.value; clock = k * pace; show(); };
  canvas.onpointerdown = e => { drag = [e.clientX, e.clientY, yaw, lift]; canvas.setPointerCapture(e.pointerId); };
  canvas.onpointermove = e => {
    if (!drag) return;
    yaw = drag[2] + (e.clientX - drag[0]) * 0.008;
    lift = Math.max(-0.2, Math.min(1.4, drag[3] + (e.clientY - drag[1]) * 0.006)); show();
  };
  canvas.onpointerup = canvas.onpointercancel = () => { drag = null; };
  window.addEventListener("resize", size);
  // A page of a run on its way hands on the frames that have come since; at the end of the slider they are followed.
  root.addEventListener("frames", e => {
    const last = k >= F.length - 1;
    F.push(...e.detail); slider.max = F.length - 1;
    if (last && !playing) k = F.length - 1;
    show();
  });
  stills(); size();
})();
