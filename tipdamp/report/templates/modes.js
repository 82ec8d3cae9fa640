// Animated mode shapes: the surfaces of the page's data, moved by the chosen mode.
// x(t) = x0 + amplitude * cos(phase) * shape; phase 0 is the mode itself, as shown while nothing plays.
function decoded(text, type) {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  return new type(bytes.buffer);
}

function displaced(rest, shape, factor) {       // three arrays x, y, z; `shape` holds x, y, z of node after node
  return [0, 1, 2].map(k => {
    const out = new Float32Array(rest.length / 3);
    for (let i = 0; i < out.length; i++) out[i] = rest[3 * i + k] + factor * shape[3 * i + k];
    return out;
  });
}

function sizes(shape) {
  const out = new Float32Array(shape.length / 3);
  for (let i = 0; i < out.length; i++) out[i] = Math.hypot(shape[3 * i], shape[3 * i + 1], shape[3 * i + 2]);
  return out;
}

function animateModes(data, id) {
  const get = part => document.getElementById(`${id}-${part}`), plot = get("plot");
  const bodies = data.bodies.map(b => ({...b, rest: decoded(b.rest, Float32Array)}));
  const zeros = bodies.map(b => new Float32Array(b.rest.length));
  let shapes = zeros, amplitude = 0, playing = false, started = 0, busy = false;

  function frame(phase) {
    const factor = amplitude * Number(get("size").value) * Math.cos(phase);
    const moved = bodies.map((b, n) => displaced(b.rest, shapes[n] || zeros[n], factor));
    const pick = k => moved.map(m => m[k]);
    return Plotly.restyle(plot, {x: pick(0), y: pick(1), z: pick(2)}, bodies.map(b => b.trace));
  }

  function choose() {
    const mode = data.modes[Number(get("mode").value)];
    shapes = bodies.map(b => mode.shapes[b.name] ? decoded(mode.shapes[b.name], Float32Array) : null);
    amplitude = mode.amplitude;
    get("caption").textContent = mode.caption;
    const color = shapes.map((s, n) => s ? sizes(s) : zeros[n].subarray(0, zeros[n].length / 3));
    Plotly.restyle(plot, {intensity: color, visible: shapes.map(s => Boolean(s))}, bodies.map(b => b.trace));
    data.outlines.forEach((o, n) => Plotly.restyle(plot, {visible: Boolean(mode.shapes[o.name])}, [o.trace]));
    return frame(0);
  }

  function step(now) {
    if (!playing) return;
    if (!busy) {
      busy = true;
      frame(2 * Math.PI * ((now - started) % data.period) / data.period).then(() => { busy = false; });
    }
    requestAnimationFrame(step);
  }

  function play(on) {
    playing = on;
    get("play").textContent = on ? "Pause" : "Play";
    started = performance.now();
    if (on) requestAnimationFrame(step); else frame(0);
  }

  get("mode").addEventListener("change", choose);
  get("size").addEventListener("input", () => { if (!playing) frame(0); });
  get("play").addEventListener("click", () => play(!playing));
  get("near").addEventListener("change", event => Plotly.relayout(plot, data.views[Number(event.target.value)]));
  return choose();
}

if (typeof module !== "undefined") module.exports = {decoded, displaced, sizes};
