// Draws each curve of `strip` over time under the scene, with a line at the replay's time; a click goes to a time.
// A push is a band from its start to its end.
// The range is that of the settled walk, from `strip.from` on; while the replay is before that, of the whole walk.
(strip) => {
  const canvas = document.getElementById("strip"), choice = document.getElementById("strip-choice");
  const pen = canvas.getContext("2d"), left = 62, right = 12, top = 4, bottom = 20, label = 12;
  const now = () => viewer.animator.actions.reduce((latest, action) => Math.max(latest, action.time), 0);
  const shown = () => strip.plots[choice ? choice.selectedIndex : 0];
  let width, height, drawn = null;

  const place = (time) => left + (time - strip.start) / (strip.end - strip.start) * (width - left - right);

  function panel(part, head, last, time) {
    const first = head + label;
    const settled = time < strip.from ? 0 : Math.max(0, shown().time.findIndex((other) => other >= strip.from));
    const numbers = part.curves.flatMap((curve) => curve.values.slice(settled)).filter((value) => value !== null);
    const values = numbers.concat(part.floor ?? []);
    let low = Math.min(...values), high = Math.max(...values);
    if (!(high > low)) [low, high] = [low - 1, high + 1];
    const level = (value) => last - (value - low) / (high - low) * (last - first);
    const outline = (curve) => curve.values.forEach((value, i, all) => {  // null where a barrier is not kept
      if (value !== null) pen[i && all[i - 1] !== null ? "lineTo" : "moveTo"](place(shown().time[i]), level(value));
    });
    pen.save();
    pen.beginPath();
    pen.rect(left, first, width - left - right, last - first);
    pen.clip();
    if (part.floor !== undefined) {
      pen.fillStyle = strip.unsafe;
      pen.beginPath();
      part.curves[0].values.forEach((value, i) => pen.lineTo(place(shown().time[i]), level(Math.min(value ?? part.floor, part.floor))));
      pen.lineTo(place(strip.end), level(part.floor));
      pen.lineTo(place(strip.start), level(part.floor));
      pen.fill();
      pen.strokeStyle = "#888";
      pen.lineWidth = 1;
      pen.beginPath();
      pen.moveTo(left, level(part.floor));
      pen.lineTo(width - right, level(part.floor));
      pen.stroke();
    }
    for (const curve of part.curves) {
      pen.strokeStyle = curve.colour;
      pen.lineWidth = 1.5;
      pen.beginPath();
      outline(curve);
      pen.stroke();
    }
    pen.restore();
    pen.fillStyle = "#222";
    pen.textAlign = "right";
    const end = (value) => (Math.abs(value) < 1e-2 * (high - low) ? 0 : value).toPrecision(3);  // hardly off zero is zero
    pen.fillText(end(high), left - 6, first + 8);
    pen.fillText(end(low), left - 6, last);
    pen.textAlign = "left";
    const at = shown().time.findIndex((other) => other >= time - 1e-9);
    const said = part.curves.map((curve) => `${curve.name} ${curve.values.at(at)?.toPrecision(3) ?? "none"}`).join(", ");
    const text = `${said} ${part.unit}`;
    pen.fillText(text, left + 6, head + 9);
  }

  function draw() {
    const time = now(), key = [time, width, height, choice && choice.selectedIndex].join();
    requestAnimationFrame(draw);
    if (key === drawn) return;
    drawn = key;
    pen.clearRect(0, 0, width, height);
    pen.fillStyle = strip.push;
    for (const [start, end] of strip.pushes ?? []) {
      pen.fillRect(place(start), top, Math.max(2, place(end) - place(start)), height - top - bottom);
    }
    pen.font = "11px system-ui, sans-serif";
    const parts = shown().parts, each = (height - top - bottom) / parts.length;
    parts.forEach((part, i) => panel(part, top + i * each + 2, top + (i + 1) * each - 4, time));
    pen.fillStyle = "#222";
    pen.textAlign = "center";
    pen.fillText(`${time.toFixed(2)} s`, Math.min(place(time), width - right - 20), height - 6);
    pen.fillRect(Math.round(place(time)), top, 1, height - top - bottom);
  }

  function fit() {
    const sharp = window.devicePixelRatio || 1;
    [width, height] = [canvas.clientWidth, canvas.clientHeight];
    [canvas.width, canvas.height] = [width * sharp, height * sharp];
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    drawn = null;
  }

  function go(event) {
    if (!event.buttons) return;
    const share = (event.offsetX - left) / (width - left - right);
    const time = strip.start + Math.min(1, Math.max(0, share)) * (strip.end - strip.start);
    viewer.animator.pause();
    viewer.animator.seek(time);
    viewer.animator.display_progress(time);
  }

  canvas.addEventListener("pointerdown", go);
  canvas.addEventListener("pointermove", go);
  window.addEventListener("resize", fit);
  fit();
  window.dispatchEvent(new Event("resize")); // the scene fits itself into what the strip leaves
  draw();
}
