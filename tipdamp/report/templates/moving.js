// Bodies that move periodically: the surfaces of the page's data, moved by the chosen motion.
// x(t) = x0 + amplitude * sum of shapes, each times cos(h phase), or -sin(h phase) where its order is -h;
// phase 0 is what is shown while nothing plays.
function decoded(text, type) {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  return new type(bytes.buffer);
}

function factors(orders, phase) {
  return orders.map(h => h < 0 ? -Math.sin(-h * phase) : Math.cos(h * phase));
}

// Three arrays x, y, z; `rest` holds x, y, z of node after node, `shapes` such a block for each of the factors.
function displaced(rest, shapes, factors) {
  const out = [0, 1, 2].map(() => new Float32Array(rest.length / 3));
  for (let i = 0; i < rest.length; i++) {
    let place = rest[i];
    for (let n = 0; n < factors.length; n++) place += factors[n] * shapes[n * rest.length + i];
    out[i % 3][(i - i % 3) / 3] = place;
  }
  return out;
}

function animateMotions(data, id) {
  const get = part => document.getElementById(`${id}-${part}`), plot = get("plot");
  const bodies = data.bodies.map(b => ({...b, rest: decoded(b.rest, Float32Array)}));
  const contacts = data.contacts && {...data.contacts, rest: decoded(data.contacts.rest, Float32Array)};
  const traces = bodies.map(b => b.trace);
  let motion = null, shapes = [], playing = false, started = 0, busy = false;

  function frame(phase) {
    const size = motion.amplitude * Number(get("size").value);
    const by = factors(motion.orders, phase).map(f => size * f);
    const moved = bodies.map((b, n) => displaced(b.rest, shapes[n], shapes[n].length ? by : []));
    const pick = k => moved.map(m => m[k]);
    const done = Plotly.restyle(plot, {x: pick(0), y: pick(1), z: pick(2)}, traces);
    return contacts ? done.then(() => mark(moved, phase)) : done;
  }

  function mark(moved, phase) {
    const n = bodies.findIndex(b => b.name === contacts.body);
    const place = [0, 1, 2].map(k => contacts.near.map(
      (i, p) => contacts.rest[3 * p + k] + moved[n][k][i] - bodies[n].rest[3 * i + k]));
    const turn = phase / (2 * Math.PI), states = motion.states;
    const now = states[Math.floor((turn - Math.floor(turn)) * states.length)];
    const color = now.map(state => contacts.colors[state]);
    return Plotly.restyle(plot, {x: [place[0]], y: [place[1]], z: [place[2]], "marker.color": [color]}, [contacts.trace]);
  }

  function choose() {
    motion = data.motions[Number(get("motion").value)];
    shapes = bodies.map(b => motion.shapes[b.name] ? decoded(motion.shapes[b.name], Float32Array) : []);
    get("caption").textContent = motion.caption;
    const shades = bodies.map(b => motion.shades[b.name]
      ? decoded(motion.shades[b.name], Float32Array) : new Float32Array(b.rest.length / 3));
    Plotly.restyle(plot, {intensity: shades, visible: shapes.map(s => s.length > 0)}, traces);
    data.outlines.forEach((o, n) => Plotly.restyle(plot, {visible: shapes[n].length > 0}, [o.trace]));
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

  get("motion").addEventListener("change", choose);
  get("size").addEventListener("input", () => { if (!playing) frame(0); });
  get("play").addEventListener("click", () => play(!playing));
  get("near")?.addEventListener("change", event => Plotly.relayout(plot, data.views[Number(event.target.value)]));
  return choose();
}

if (typeof module !== "undefined") module.exports = {decoded, displaced, factors};
