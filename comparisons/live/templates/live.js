// The page of cgla live: what is dragged here is sent to the server, and the newest answer is drawn.
'use strict';
(async () => {
  const { $, el, isNumber, figure, percent, seconds, chosen, isDark, colourOf, remembered, setTheme, mapCanvases, riskBar, pointsOf, SVG_DASHES } = drawing;
  const SVG = 'http://www.w3.org/2000/svg';
  const MOST_UNDO = 500, MOST_CORNERS = 80, REST = 200, FOLLOWS = 0.03, RADIUS = 7;
  const svg = (tag, attributes = {}, ...children) => {
    const node = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
    node.append(...children);
    return node;
  };
  setTheme(remembered() ?? 'auto');

  // ---- the server
  const page = Array.from(crypto.getRandomValues(new Uint8Array(12)), byte => byte.toString(16).padStart(2, '0')).join('');
  async function ask(what, body) {
    try {
      const answer = await fetch(what, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body) });
      const found = await (answer.headers.get('Content-Type') === 'application/json' ? answer.json() : answer.text().then(error => ({ error })));
      return { ...found, status: answer.status };
    } catch {
      return { error: 'cgla live does not answer: it has ended, or the connection is lost.', lost: true };
    }
  }
  let given;
  try {
    given = await (await fetch('map')).json();
  } catch {
    $('#problem').hidden = false;
    $('#problem').textContent = 'The map cannot be loaded: cgla live has ended.';
    return;
  }
  const [xMin, yMin, xMax, yMax] = given.map.bounds, yDown = given.map.y_down, side = Math.max(xMax - xMin, yMax - yMin);
  const digits = Math.max(0, 5 - Math.ceil(Math.log10(side))), rounded = value => Number(value.toFixed(digits));
  const within = (value, low, high) => Math.min(Math.max(value, low), high);
  // places of a map in degrees: all are drawn in metres, and read and written in degrees
  const inDegrees = given.degrees, { origin, compass } = given;
  const lonLat = place => earth.inverse(origin, place);
  const fine = Math.min(Math.max(0, (inDegrees ? 5 : 4) - Math.ceil(Math.log10(inDegrees ? side / 111320 : side))), 12);
  const written = place => {
    // (the corners of a map of the whole Earth)
    if (inDegrees && Math.hypot(...place) > 20003931) return 'no place on the Earth';
    const [u, v] = inDegrees ? lonLat(place) : place;
    return inDegrees ? `${earth.text(u, 'EW', fine)}, ${earth.text(v, 'NS', fine)}` : `${u.toFixed(fine)}, ${v.toFixed(fine)}`;
  };
  // how far beyond the bounds things may be dragged, and are seen
  const reach = 0.05 * side;

  const state = {
    draft: given.draft, number: 0, chosen: null, answer: null, answered: -1,
    others: [], undo: [], redo: [], drag: null, changedAt: 0,
  };
  const copy = () => structuredClone(state.draft);

  // ---- what can be moved: each handle is a kind and up to two numbers
  const same = (one, other) => one && other && one.kind === other.kind && one.i === other.i && one.j === other.j;
  const AREA = new Set(['area', 'corner']), THREAT = new Set(['threat', 'spread']);
  const exists = ({ kind, i, j }) => THREAT.has(kind) ? i < state.draft.threats.length
    : !AREA.has(kind) || i < state.draft.areas.length && (kind === 'area' || j < state.draft.areas[i].length);
  function placeOf({ kind, i, j }) {
    const { threats, areas } = state.draft;
    if (kind === 'start' || kind === 'goal') return state.draft[kind];
    if (kind === 'threat') return [threats[i].x, threats[i].y];
    if (kind === 'spread') return [threats[i].x + threats[i].spread, threats[i].y];
    if (kind === 'corner') return areas[i][j];
    const n = areas[i].length;
    return [areas[i].reduce((sum, p) => sum + p[0], 0) / n, areas[i].reduce((sum, p) => sum + p[1], 0) / n];
  }
  function put({ kind, i, j }, [x, y]) {
    if (kind === 'threat') Object.assign(state.draft.threats[i], { x, y });
    else if (kind === 'corner') state.draft.areas[i][j] = [x, y];
    else state.draft[kind] = [x, y];
  }
  function moveTo(handle, x, y) {
    const { kind, i } = handle, { threats, areas } = state.draft;
    const [u0, v0] = placeOf(handle);
    // what a file has put further out may come back in steps
    x = rounded(within(x, Math.min(xMin - reach, u0), Math.max(xMax + reach, u0)));
    y = rounded(within(y, Math.min(yMin - reach, v0), Math.max(yMax + reach, v0)));
    if (kind === 'start' || kind === 'goal' || kind === 'threat' || kind === 'corner') put(handle, [x, y]);
    else if (kind === 'spread') setSpread(i, Math.abs(x - threats[i].x));
    else {
      const [a, b] = placeOf(handle);
      areas[i] = areas[i].map(([u, v]) => [rounded(u + x - a), rounded(v + y - b)]);
    }
  }
  const setSpread = (i, spread) => { state.draft.threats[i].spread = Number(within(spread, side / 300, side).toPrecision(5)); };
  const nameOf = ({ kind, i, j }) => ({ start: 'start', goal: 'goal', threat: `threat ${i + 1}`, spread: `spread of threat ${i + 1}`, area: `no-fly area ${i + 1}`, corner: `corner ${j + 1} of no-fly area ${i + 1}` })[kind];
  const words = handle => {
    const [x, y] = placeOf(handle), one = THREAT.has(handle.kind) && state.draft.threats[handle.i];
    return `${nameOf(handle)} at ${written([x, y])}${one ? `; spread ${figure(one.spread, 3)}, peak ${figure(one.peak, 3)}` : ''}`;
  };

  // ---- undo
  function remember(before) {
    if (JSON.stringify(before) === JSON.stringify(state.draft)) return;
    state.undo.push(before);
    if (state.undo.length > MOST_UNDO) state.undo.shift();
    state.redo = [];
    buttons();
  }
  /** Change the draft in one step that can be undone; steps of the same kind right after one another are one. */
  let last = { what: null, at: 0 };
  function step(what, change) {
    const before = copy(), now = performance.now();
    change();
    if (what && what === last.what && now - last.at < 800 && state.undo.length) state.redo = [];
    else remember(before);
    last = { what, at: now };
    changed();
  }
  function turn(from, to) {
    if (!from.length || state.drag) return;
    to.push(copy());
    state.draft = from.pop();
    last.what = null;
    if (state.chosen && !exists(state.chosen)) state.chosen = null;
    changed();
    say(from === state.undo ? 'undone' : 'done again');
  }
  const buttons = () => { $('#undo').disabled = !state.undo.length; $('#redo').disabled = !state.redo.length; };
  let saying = 0;
  const say = text => { clearTimeout(saying); saying = setTimeout(() => { $('#said').textContent = text; }, 150); };

  // ---- asking: one quick question at a time, always about the newest state; all the rest when nothing moves
  let asking = false, resting = 0;
  const request = () => ({ page, number: state.number, map: given.reading, draft: copy() });
  function changed() {
    state.number += 1;
    state.changedAt = performance.now();
    buttons();
    mark();
    paint();
    clearTimeout(resting);
    follow();
  }
  async function follow() {
    if (asking) return;
    asking = true;
    let lost = false;
    do {
      const sent = request(), from = state.changedAt;
      const answer = await ask('path', sent);
      lost = Boolean(answer.lost);
      if (!answer.replaced) take(answer, sent, from);
      if (!lost) for (const one of state.others) if (one.seconds !== null && one.seconds < FOLLOWS && one.fast) compare(one);
      if (state.answered < sent.number && !lost) await new Promise(done => { setTimeout(done, 50); });
    } while (state.answered < state.number && !lost);
    asking = false;
    clearTimeout(resting);
    if (!lost) resting = setTimeout(rest, REST);
  }
  async function rest() {
    if (state.drag) { resting = setTimeout(rest, REST); return; }
    const sent = { ...request(), full: true };
    for (const one of state.others) if (one.number !== state.number) compare(one);
    const answer = await ask('path', sent);
    if (!answer.replaced && sent.number === state.number) {
      take(answer, sent, null);
      say(answer.error || `cost ${figure(answer.cost, 4)}, gap at most ${percent(gapOf(answer.cost))}`);
    }
  }
  function take(answer, { number, draft }, from) {
    state.answered = number;
    const { areas = [], notes = [] } = answer, seen = { areas, notes, drawn: draft.areas };
    // malformed is what no number says
    state.answer = answer.error !== null && answer.error !== undefined ? { error: answer.error, path: [], tube: null, ...seen } : { ...answer, ...seen };
    paint();
    // until it is seen
    if (from !== null) requestAnimationFrame(() => live.latencies.push(performance.now() - from));
  }
  async function compare(one) {
    if (one.busy) return;
    one.busy = true;
    const sent = { ...request(), solver: one.name };
    const answer = await ask('solver', sent);
    one.busy = false;
    if (!state.others.includes(one)) return;
    if (answer.replaced || answer.lost) {
      if (answer.replaced && sent.number === state.number) setTimeout(() => compare(one), REST);
      return;
    }
    Object.assign(one, { answer, number: sent.number, seconds: answer.seconds ?? null });
    // what has come too late is asked for again when nothing moves
    if (sent.number !== state.number && !state.drag && !asking) compare(one);
    paint();
  }
  const gapOf = cost => {
    const bound = state.answer && state.answer.bound;
    return isNumber(cost) && bound > 0 ? cost / bound - 1 : isNumber(cost) && bound === 0 && cost === 0 ? 0 : null;
  };

  // ---- the picture
  const stage = $('#stage'), map = $('#map');
  let scale = 1, width = 1, height = 1;
  const across = x => (x - xMin) * scale, down = y => (yDown ? y - yMin : yMax - y) * scale;
  const path = (points, closed) => points.length ? `M${points.map(([x, y]) => `${across(x).toFixed(1)},${down(y).toFixed(1)}`).join('L')}${closed ? 'Z' : ''}` : '';
  const pairs = flat => flat.reduce((list, value, i) => (i % 2 ? list.at(-1).push(value) : list.push([value]), list), []);
  const layers = Object.fromEntries(['axes', 'below', 'areas', 'tube', 'rings', 'paths', 'handles', 'ends'].map(name => [name, svg('g')]));
  // areas may go on far beyond the map
  const clip = svg('rect');
  map.append(svg('defs', {}, svg('clipPath', { id: 'seen' }, clip)), ...Object.values(layers));
  layers.axes.setAttribute('aria-hidden', 'true');
  for (const name of ['below', 'areas', 'rings']) layers[name].setAttribute('clip-path', 'url(#seen)');
  function fit() {
    const parent = stage.parentElement.clientWidth, tall = Math.max(280, innerHeight * (innerWidth < 900 ? 0.62 : 0.73));
    const [along, up] = ticks(), left = 14 + 6.9 * Math.max(2, ...up.map(([, text]) => text.length)), bottom = 24, least = 16;
    // areas and handles beyond the bounds have room, and so have the labels of the axes
    scale = Math.min((parent - left - least) / (xMax - xMin), (parent - left) / (xMax - xMin + reach), tall / (yMax - yMin + 2 * reach));
    const margin = reach * scale;
    [width, height] = [(xMax - xMin) * scale, (yMax - yMin) * scale];
    stage.style.width = `${width}px`;
    stage.style.height = `${height}px`;
    stage.style.marginTop = `${Math.max(margin, least)}px`;
    stage.style.marginBottom = `${Math.max(margin, bottom)}px`;
    const begin = Math.max(left, (parent - width) / 2);
    stage.style.marginLeft = `${begin}px`;
    $('.below').style.paddingInline = width > 420 ? `${begin}px ${Math.max(0, parent - width - begin)}px` : '';
    for (const [name, value] of Object.entries({ x: -margin, y: -margin, width: width + 2 * margin, height: height + 2 * margin })) clip.setAttribute(name, value);
    map.setAttribute('viewBox', `0 0 ${width} ${height}`);
    layers.below.replaceChildren(svg('path', { class: 'fixed', d: given.map.no_fly.map(flat => path(pointsOf(flat, given.map.bounds), true)).join('') }));
    layers.axes.replaceChildren(...axis(along, false, left), ...axis(up, true, left));
    measure();
    paint();
  }
  /** Steps of 1, 2 or 5 times a power of ten, about as many as wanted, and the digits that they need. */
  function even(span, wanted, factors = [1, 2, 5, 10]) {
    const rough = span / wanted, unit = 10 ** Math.floor(Math.log10(rough)), by = unit * factors.find(one => one * unit >= rough * (1 - 1e-9));
    return [by, Math.max(0, Math.ceil(-Math.log10(by) - 1e-9))];
  }
  /** Places and labels along the lower and the left side: degrees where the map is on the Earth, else its own units. */
  function ticks() {
    if (given.map.axes) return given.map.axes.map(([places, texts]) => places.map((place, i) => [place, texts[i]]));
    if (origin) return [[], []];
    const [by, places] = even(side, 5);
    return [[xMin, xMax], [yMin, yMax]].map(([low, high]) => {
      const first = Math.ceil(low / by - 1e-9), last = Math.floor(high / by + 1e-9);
      return Array.from({ length: Math.max(last - first + 1, 0) }, (_, i) => [(first + i) * by, ((first + i) * by).toFixed(places)]);
    });
  }
  function axis(marks, upright, left) {
    const at = marks.map(([place]) => upright ? down(place) : across(place)), longest = Math.max(0, ...marks.map(([, text]) => text.length)) * 6.9;
    const apart = at.length > 1 ? Math.abs(at[1] - at[0]) : Infinity, every = Math.ceil((upright ? 16 : longest + 12) / apart);
    const found = marks.flatMap(([, text], i) => {
      if (i % every) return [];
      const half = 3.45 * text.length, line = upright ? { x1: -5, x2: 0, y1: at[i], y2: at[i] } : { y1: height, y2: height + 5, x1: at[i], x2: at[i] };
      const place = upright ? { x: -8, y: at[i] + 4, 'text-anchor': 'end' } : { x: within(at[i], half - left, width + 16 - half), y: height + 18, 'text-anchor': 'middle' };
      return [svg('line', { class: 'tick', ...line }), svg('text', { class: 'tick-label', ...place }, text)];
    });
    // a plane has no north: its axes say which way they go
    if (!origin) found.push(upright ? svg('text', { class: 'tick-label', x: -8, y: -10, 'text-anchor': 'end' }, yDown ? 'y ↓' : 'y ↑') : svg('text', { class: 'tick-label', x: width + 5, y: height + 4 }, 'x'));
    return found;
  }
  /** The scale bar, and north: both as they are in the middle of the map. */
  function measure() {
    const true_side = (xMax - xMin) * (compass?.metres ?? 1), [length] = even(true_side, 8), pixels = length / (compass?.metres ?? 1) * scale;
    const unit = !given.unit ? `${Number(length.toPrecision(6))} map units` : length >= 1000 ? `${Number((length / 1000).toPrecision(6))} km` : `${Number(length.toPrecision(6))} m`;
    const where = compass?.spread > 0.01 ? ' in the middle' : '', n = pixels.toFixed(2);
    const bar = svg('svg', { width: pixels + 2, height: 9, 'aria-hidden': 'true' }, svg('path', { class: 'bar', d: `M1,1v7M1,7h${n}m0,1v-7` }));
    $('#scale').replaceChildren(bar, el('span', {}, unit + where));
    $('#scale').setAttribute('aria-label', `Scale: the bar is ${unit} long${where && ' in the middle of the map'}`);
    const north = $('#north'), turn = compass?.north ?? null;
    north.hidden = turn === null;
    if (turn === null) return;
    const said = Math.abs(turn) < 0.5 ? 'North is up' : `North is ${Math.abs(turn).toFixed(0)}° to the ${turn < 0 ? 'left' : 'right'} of up`;
    const sentence = `${said} in the middle of the map${compass.turn > 1 ? `; elsewhere it differs by up to ${Math.ceil(compass.turn)}°` : ''}`;
    north.replaceChildren(svg('svg', { width: 18, height: 22, viewBox: '-9 -11 18 22', 'aria-hidden': 'true' }, svg('path', { class: 'needle', transform: `rotate(${turn.toFixed(2)})`, d: 'M0,-10L5,8L0,4L-5,8Z' })), el('span', {}, 'N'));
    north.setAttribute('aria-label', sentence);
    north.title = sentence;
  }
  let under = null;
  /** Coordinates of the pointer, or else of the chosen thing. */
  function readout() {
    const place = under || state.chosen && exists(state.chosen) && placeOf(state.chosen), node = $('#at');
    let text = '\u00a0';
    if (place) {
      const names = under ? '' : `${nameOf(state.chosen)}: `, own = inDegrees ? written(place) : `x ${place[0].toFixed(fine)}, y ${place[1].toFixed(fine)}`;
      const [u, v] = origin && !inDegrees ? lonLat(place) : [];
      text = names + own + (u === undefined ? '' : ` (${earth.text(u, 'EW', 5)}, ${earth.text(v, 'NS', 5)})`);
    }
    if (node.textContent !== text) node.textContent = text;
  }
  /** The risk of the draft, as the report's maps have it: 256 levels. */
  function risk() {
    const { rows, columns, raster, power } = given.samples, n = rows * columns, clear = new Float64Array(n).fill(1);
    const xs = Float64Array.from({ length: columns }, (_, i) => xMin + (i + 0.5) * (xMax - xMin) / columns);
    const ys = Float64Array.from({ length: rows }, (_, i) => yMin + (i + 0.5) * (yMax - yMin) / rows);
    for (const { x, y, spread, peak } of state.draft.threats) {
      const part = (at, centre) => Math.exp(-0.5 * ((at - centre) / spread) ** 2);
      const gx = xs.map(at => peak * part(at, x)), gy = ys.map(at => part(at, y));
      for (let row = 0; row < rows; row++) {
        if (gy[row] < 1e-9) continue;
        for (let column = 0; column < columns; column++) clear[row * columns + column] *= 1 - gx[column] * gy[row];
      }
    }
    let low = 0, top = 0;
    const density = clear;
    for (let i = 0; i < n; i++) {
      density[i] = 1 - clear[i] + (raster ? raster[i] : 0);
      if (density[i] < low) low = density[i];
      if (density[i] > top) top = density[i];
    }
    // a narrow peak is between samples
    if (!raster) for (const { x, y, peak } of state.draft.threats) if (x >= xMin && x <= xMax && y >= yMin && y <= yMax) top = Math.max(top, Math.min(peak, 1));
    if (!(top > low)) return null;
    const levels = Uint8Array.from(density, value => Math.round(255 * within((value - low) / (top - low), 0, 1) ** power));
    return { rows, columns, low, top, power, levels };
  }
  let painted = '', barred = '';
  function paintRisk() {
    const key = JSON.stringify([state.draft.threats, isDark()]);
    if (key === painted) return;
    painted = key;
    // as many pixels as there are samples: the browser stretches it, which is faster than drawing it anew
    const canvas = $('#risk'), found = risk(), pictures = mapCanvases({ ...given.map, risk: found });
    Object.assign(canvas, { width: Math.max(1, ...pictures.map(one => one.width)), height: Math.max(1, ...pictures.map(one => one.height)) });
    const context = canvas.getContext('2d');
    for (const one of pictures) context.drawImage(one, 0, 0, canvas.width, canvas.height);
    const bar = JSON.stringify([found?.low, found?.top, isDark()]);
    if (bar !== barred) riskBar(found);
    barred = bar;
  }
  let waiting = false;
  function paint() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      paintRisk();
      build();
      position();
      paintAnswer();
    });
  }

  // a handle is made when it is wanted first, and stays as long as it is: who holds one keeps it
  let built = '', handles = [];
  function wanted() {
    const { threats, areas } = state.draft, found = [];
    const all_corners = areas.reduce((sum, area) => sum + area.length, 0) <= MOST_CORNERS;
    areas.forEach((area, i) => {
      found.push({ kind: 'area', i });
      if (all_corners || AREA.has(state.chosen?.kind) && state.chosen.i === i) area.forEach((_, j) => found.push({ kind: 'corner', i, j }));
    });
    threats.forEach((_, i) => {
      found.push({ kind: 'threat', i });
      if (THREAT.has(state.chosen?.kind) && state.chosen.i === i) found.push({ kind: 'spread', i });
    });
    return [...found, { kind: 'start' }, { kind: 'goal' }];
  }
  const coarse = matchMedia('(pointer: coarse)');
  function build() {
    const list = wanted(), key = JSON.stringify(list);
    if (key === built) return;
    built = key;
    const held = new Map(handles.map(one => [JSON.stringify([one.kind, one.i, one.j]), one]));
    layers.rings.replaceChildren(...state.draft.threats.map(() => svg('circle', { class: 'ring' })));
    handles = list.map(handle => {
      const name = JSON.stringify([handle.kind, handle.i, handle.j]), one = held.get(name) || make(handle);
      held.delete(name);
      return one;
    });
    for (const { node } of held.values()) node.remove();
  }
  function make(handle) {
    const common = { tabindex: 0, role: 'button', 'aria-roledescription': 'movable', 'data-handle': handle.kind };
    if (handle.kind === 'area') {
      const node = svg('path', { ...common, class: 'area handle' });
      layers.areas.append(node);
      return { ...handle, node };
    }
    const hit = svg('circle', { class: 'hit', r: coarse.matches ? (handle.kind === 'corner' ? 16 : 22) : 12 });
    const mark = {
      spread: () => svg('rect', { class: 'mark', x: -5, y: -5, width: 10, height: 10 }),
      goal: () => svg('path', { class: 'mark', d: 'M0,-10L2.9,-3.6L9.8,-3L4.6,1.6L6.2,8.4L0,4.8L-6.2,8.4L-4.6,1.6L-9.8,-3L-2.9,-3.6Z' }),
      corner: () => svg('circle', { class: 'mark', r: 4.5 }), threat: () => svg('circle', { class: 'mark', r: 6 }), start: () => svg('circle', { class: 'mark', r: RADIUS }),
    }[handle.kind]();
    const node = svg('g', { ...common, class: `handle ${handle.kind}` }, hit, mark);
    if (handle.kind === 'start' || handle.kind === 'goal') node.append(svg('text', { class: 'end-label', 'text-anchor': 'middle' }, handle.kind));
    layers[handle.kind === 'start' || handle.kind === 'goal' ? 'ends' : 'handles'].append(node);
    return { ...handle, node };
  }
  /** The closed area of the newest answer where it differs from the polygon of the corners: sides bend, or cross each other. */
  function outline(i) {
    const { areas, drawn } = state.answer ?? {}, own = state.draft.areas[i];
    return areas?.[i] && JSON.stringify(drawn[i]) === JSON.stringify(own) ? areas[i].map(pairs) : [own];
  }
  function position() {
    handles.forEach(handle => {
      if (!exists(handle)) return;
      const [x, y] = placeOf(handle);
      if (handle.kind === 'area') handle.node.setAttribute('d', outline(handle.i).map(ring => path(ring, true)).join(''));
      // what is beyond what is seen has its handle at the rim
      else handle.node.setAttribute('transform', `translate(${across(within(x, xMin - reach, xMax + reach)).toFixed(1)} ${down(within(y, yMin - reach, yMax + reach)).toFixed(1)})`);
      const label = words(handle);
      if (handle.label !== label) handle.node.setAttribute('aria-label', label);
      handle.label = label;
      // on the side of the map that is nearer: the path goes the other way
      handle.node.querySelector('.end-label')?.setAttribute('y', down(y) > height / 2 ? 25 : -15);
      handle.node.classList.toggle('chosen', Boolean(same(handle, state.chosen)));
    });
    state.draft.threats.forEach((one, i) => {
      const ring = layers.rings.children[i];
      if (!ring) return;
      for (const [name, value] of Object.entries({ cx: across(one.x), cy: down(one.y), r: one.spread * scale })) ring.setAttribute(name, value.toFixed(1));
      ring.classList.toggle('chosen', THREAT.has(state.chosen?.kind) && state.chosen.i === i);
    });
    thing();
    readout();
    const k = state.draft.k;
    if (document.activeElement !== $('#k')) $('#k').value = Math.round(1000 * within(k / kTop, 0, 1) ** (1 / 3));
    $('#k').setAttribute('aria-valuetext', `k = ${figure(k, 4)}`);
    if (document.activeElement !== $('#k-number')) $('#k-number').value = Number(k.toPrecision(5));
  }
  const look = place => ({ stroke: colourOf(place), 'stroke-dasharray': SVG_DASHES[place % SVG_DASHES.length] });
  let pictured = '', seen = [];
  function paintAnswer() {
    const answer = state.answer, every = [answer, ...state.others.flatMap(one => [one, one.answer])];
    // while something moves, only the handles do until there is an answer
    const key = JSON.stringify([isDark(), width, height, state.others.map(one => one.number === state.number), state.answered < state.number - 3]);
    if (key === pictured && every.length === seen.length && every.every((one, i) => one === seen[i])) return;
    [pictured, seen] = [key, every];
    $('#problem').hidden = !answer?.error;
    $('#problem').textContent = answer?.error || '';
    const notes = [given.note, ...answer?.notes ?? []].filter(Boolean);
    $('#note').hidden = !notes.length;
    $('#note').textContent = notes.join(' ');
    $('#answer').classList.toggle('old', state.answered < state.number - 3);
    const gap = gapOf(answer?.cost);
    const write = (id, text) => { $(id).textContent = text; };
    write('#cost', amount(answer?.cost));
    // rounded down, as the gap is rounded up: both are promises
    write('#bound', amount(answer?.bound, Math.floor));
    write('#gap', gap === null ? '–' : `${(Math.ceil(Math.max(gap, 0) * 1e4 - 1e-6) / 100).toFixed(2)} %`);
    write('#length', amount(answer?.length));
    $('#answer').classList.toggle('long', ['#cost', '#bound', '#length'].some(id => $(id).textContent.length > 10));
    write('#total-risk', figure(answer?.risk, 3));
    write('#took', isNumber(answer?.seconds) ? seconds(answer.seconds) : '–');
    const tube = answer?.tube || [];
    let d = '';
    for (let i = 0; i < tube.length; i += 4) {
      // a little higher than they are, so that no line is seen between two
      const [x, y, w, h] = [across(tube[i]), down(tube[i + 1]) + (yDown ? -0.3 : 0.3), tube[i + 2] * scale, tube[i + 3] * scale + 0.6];
      d += `M${x.toFixed(1)},${(yDown ? y : y - h).toFixed(1)}h${w.toFixed(1)}v${h.toFixed(1)}h${(-w).toFixed(1)}z`;
    }
    layers.tube.replaceChildren(...(d ? [svg('path', { class: 'tube', d })] : []));
    const shown = [...state.others.filter(one => one.answer?.path.length), ...(answer?.path.length ? [{ answer, colour: 0, number: state.number }] : [])];
    layers.paths.replaceChildren(...shown.flatMap(one => {
      const line = path(pairs(one.answer.path), false), old = one.number === state.number ? '' : ' old-path', wide = one.colour ? 2.5 : 3.5;
      return [svg('path', { class: 'halo', d: line, 'stroke-width': wide + 2.5 }), svg('path', { class: `path${old}`, d: line, 'stroke-width': wide, ...look(one.colour) })];
    }));
    table();
  }
  /** A cost or length: five digits, or whole units where that is more. */
  function amount(value, round = Math.round) {
    if (!isNumber(value) || value === 0) return isNumber(value) ? '0' : '–';
    const places = Math.min(Math.max(4 - Math.floor(Math.log10(Math.abs(value))), 0), 12), unit = given.unit && ` ${given.unit}`;
    return (round(value * 10 ** places) / 10 ** places).toLocaleString('en', { minimumFractionDigits: places, useGrouping: true }) + unit;
  }
  function swatch(place) {
    return svg('svg', { class: 'swatch', viewBox: '0 0 34 10', 'aria-hidden': 'true' }, svg('line', { x1: 1, x2: 33, y1: 5, y2: 5, 'stroke-width': 4, ...look(place) }));
  }
  let tabled = '';
  function table() {
    const rows = [{ name: 'hybrid', colour: 0, answer: state.answer, number: state.answered, main: true }, ...state.others];
    const key = JSON.stringify([isDark(), rows.map(({ name, answer, number }) => [name, number === state.number, answer && [answer.error, answer.cost, answer.seconds, state.answer?.bound]])]);
    if (key === tabled) return;
    tabled = key;
    const focused = document.activeElement?.dataset?.remove;
    $('#paths tbody').replaceChildren(...rows.map(({ name, colour, answer, number, main }) => {
      const head = el('th', { scope: 'row' }, swatch(colour), name), gap = gapOf(answer?.cost);
      const cells = !answer ? [el('td', { colSpan: 3 }, 'waiting …')]
        : answer.error ? [el('td', { colSpan: 3, className: 'why' }, main ? 'no path' : answer.error)]
          : [el('td', {}, amount(answer.cost)), el('td', {}, gap === null ? '–' : percent(Math.max(gap, 0))), el('td', {}, isNumber(answer.seconds) ? seconds(answer.seconds) : '–')];
      const away = el('td');
      if (!main) {
        const button = el('button', { type: 'button', 'aria-label': `Remove ${name}` }, '×');
        button.dataset.remove = name;
        away.append(button);
      }
      return el('tr', { className: number === state.number || main ? '' : 'old' }, head, ...cells, away);
    }));
    if (focused) $(`[data-remove="${CSS.escape(focused)}"]`)?.focus();
  }

  // ---- what is chosen, and its numbers
  let thinged = '';
  function thing() {
    const handle = state.chosen, box = $('#thing'), kind = handle && (THREAT.has(handle.kind) ? 'threat' : AREA.has(handle.kind) ? 'area' : 'end');
    const key = handle ? `${handle.kind} ${handle.i} ${handle.j} ${kind === 'area' ? state.draft.areas[handle.i]?.length : ''}` : '';
    if (key !== thinged) {
      thinged = key;
      const title = handle ? nameOf(kind === 'threat' ? { ...handle, kind: 'threat' } : handle) : 'Nothing chosen';
      $('#thing-title').textContent = title[0].toUpperCase() + title.slice(1);
      const slider = (id, word) => el('label', { className: 'row' }, el('span', {}, word), el('input', { type: 'range', id, min: 0, max: 1000, step: 1 }), el('output', { id: `${id}-value` }));
      const button = (id, word) => el('button', { type: 'button', id }, word);
      const field = (id, word, label) => el('label', { className: 'row' }, el('span', {}, word), el('input', { type: 'number', id, step: 'any', className: 'place', 'aria-label': `${label} of ${title}` }));
      const fields = () => inDegrees ? [field('at-x', 'longitude', 'longitude'), field('at-y', 'latitude', 'latitude')] : [field('at-x', 'x', 'x'), field('at-y', 'y', 'y')];
      box.replaceChildren(...({
        threat: () => [...fields(), slider('spread', 'spread'), slider('peak', 'peak'), el('p', { className: 'buttons' }, button('remove', 'Delete threat'))],
        area: () => [...(handle.kind === 'corner' ? fields() : []), el('p', { className: 'buttons' }, button('add-corner', 'Add corner'), ...(handle.kind === 'corner' ? [button('remove-corner', 'Delete corner')] : []), button('remove', 'Delete area'))],
        end: fields,
      }[kind] || (() => [el('p', { className: 'soft' }, 'Drag a threat, an end, an area or one of its corners.')]))());
      const on = (id, event, act) => $(id, box)?.addEventListener(event, act);
      if ($('#at-x', box)) for (const id of ['#at-x', '#at-y']) entered($(id), () => typed(handle.kind === 'spread' ? { ...handle, kind: 'threat' } : handle));
      on('#spread', 'input', ({ target }) => step(`spread ${handle.i}`, () => setSpread(handle.i, side / 200 * 100 ** (target.value / 1000))));
      on('#peak', 'input', ({ target }) => step(`peak ${handle.i}`, () => { state.draft.threats[handle.i].peak = Number(Math.max(peakTop * target.value / 1000, 0.001).toPrecision(4)); }));
      on('#remove', 'click', () => remove(kind === 'area' ? { kind: 'area', i: handle.i } : { kind: 'threat', i: handle.i }));
      on('#remove-corner', 'click', () => remove(handle));
      on('#add-corner', 'click', () => addCorner(handle.i));
    }
    if ($('#at-x', box)) {
      const shown = numbersOf(handle.kind === 'spread' ? { ...handle, kind: 'threat' } : handle);
      ['#at-x', '#at-y'].forEach((id, i) => { if (document.activeElement !== $(id)) $(id).value = shown[i]; });
    }
    if (kind === 'threat') {
      const one = state.draft.threats[handle.i];
      if (document.activeElement !== $('#spread')) $('#spread').value = Math.round(1000 * Math.log(one.spread / side * 200) / Math.log(100));
      if (document.activeElement !== $('#peak')) $('#peak').value = Math.round(1000 * one.peak / peakTop);
      $('#spread-value').textContent = figure(one.spread, 3);
      $('#peak-value').textContent = figure(one.peak, 3);
      $('#spread').setAttribute('aria-valuetext', figure(one.spread, 3));
      $('#peak').setAttribute('aria-valuetext', figure(one.peak, 3));
    }
  }
  /** The coordinates of a handle as its fields have them: degrees to a centimetre. */
  function numbersOf(handle) {
    const place = placeOf(handle);
    return inDegrees ? lonLat(place).map(value => Number(value.toFixed(7))) : place;
  }
  function typed(handle) {
    const fields = [$('#at-x'), $('#at-y')], before = numbersOf(handle), found = fields.map(node => node.value === '' ? NaN : Number(node.value));
    const known = found.every(value => Math.abs(value) <= 1e15) && (!inDegrees || Math.abs(found[0]) <= 540 && Math.abs(found[1]) <= 90);
    const place = !known ? null : inDegrees ? earth.forward(origin, found) : found;
    if (!place) {
      fields.forEach((node, i) => { node.value = before[i]; });
      say(inDegrees ? 'give a longitude from −180 to 180 and a latitude from −90 to 90' : 'give a number');
      return;
    }
    if (found.every((value, i) => value === before[i])) return;
    step(null, () => put(handle, place));
    say(words(handle));
  }
  /** Act on a number that was entered, and again where the field undoes that: what it shows is what holds. */
  function entered(node, act) {
    let typing = false;
    node.addEventListener('change', () => { typing = false; act(); });
    node.addEventListener('input', ({ inputType }) => {
      if (!(inputType ?? '').startsWith('history')) typing = true;
      else if (!typing) act();
    });
  }
  const peakTop = given.improper ? Math.max(2, ...given.draft.threats.map(one => one.peak)) : 1;
  const kTop = 10 * Math.max(given.draft.k, 1);
  function choose(handle) {
    if (same(handle, state.chosen)) return;
    state.chosen = handle;
    paint();
  }
  function addThreat(x, y) {
    const spreads = state.draft.threats.map(one => one.spread).sort((a, b) => a - b);
    const one = { x: rounded(within(x, xMin, xMax)), y: rounded(within(y, yMin, yMax)), spread: spreads[spreads.length >> 1] || side / 20, peak: state.draft.threats.length ? Math.min(1, state.draft.threats[0].peak) : 1 };
    step(null, () => state.draft.threats.push(one));
    state.chosen = { kind: 'threat', i: state.draft.threats.length - 1 };
    say(`added ${words(state.chosen)}`);
  }
  function addArea() {
    const [x, y] = [(xMin + xMax) / 2, (yMin + yMax) / 2], r = side / 16;
    step(null, () => state.draft.areas.push([[-r, -r], [r, -r], [r, r], [-r, r]].map(([u, v]) => [rounded(x + u), rounded(y + v)])));
    state.chosen = { kind: 'area', i: state.draft.areas.length - 1 };
    say(`added ${words(state.chosen)}`);
  }
  /** The middle of a side: sides are straight in degrees where the map is in degrees, so that it changes no area. */
  function between(a, b) {
    const mean = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
    if (!inDegrees) return mean;
    const [[u, v], [p, q]] = [lonLat(a), lonLat(b)];
    return earth.forward(origin, [u + earth.wrapped(p - u) / 2, (v + q) / 2]) ?? mean;
  }
  function addCorner(i) {
    const area = state.draft.areas[i], far = area.map((p, j) => Math.hypot(p[0] - area[(j + 1) % area.length][0], p[1] - area[(j + 1) % area.length][1]));
    const j = far.indexOf(Math.max(...far)), [a, b] = [area[j], area[(j + 1) % area.length]];
    step(null, () => area.splice(j + 1, 0, between(a, b).map(rounded)));
    state.chosen = { kind: 'corner', i, j: j + 1 };
  }
  function remove(handle) {
    const { kind, i, j } = handle, { threats, areas } = state.draft;
    if (kind === 'start' || kind === 'goal') return;
    const gone = nameOf(THREAT.has(kind) ? { kind: 'threat', i } : handle), corner = kind === 'corner' && areas[i].length > 3;
    step(null, () => { if (THREAT.has(kind)) threats.splice(i, 1); else if (corner) areas[i].splice(j, 1); else areas.splice(i, 1); });
    state.chosen = null;
    say(`removed ${gone}`);
    if (document.activeElement === document.body) map.querySelector('[tabindex]')?.focus();
  }

  // ---- pointers and keys
  const pointed = event => {
    const box = map.getBoundingClientRect(), x = (event.clientX - box.left) / scale, y = (event.clientY - box.top) / scale;
    return [xMin + x, yDown ? yMin + y : yMax - y];
  };
  const handleOf = node => handles.find(one => one.node === node.closest?.('[data-handle]'));
  map.addEventListener('pointerdown', event => {
    const found = handleOf(event.target);
    if (event.button || state.drag) return;
    if (!found) { choose(null); return; }
    const { kind, i, j } = found, handle = { kind, i, j };
    const [x, y] = pointed(event), [a, b] = placeOf(handle);
    state.drag = { handle, id: event.pointerId, dx: a - x, dy: b - y, before: copy() };
    map.setPointerCapture(event.pointerId);
    choose(handle);
    found.node.focus({ preventScroll: true });
    event.preventDefault();
  });
  // a finger that holds something does not scroll the page
  map.addEventListener('touchstart', event => { if (handleOf(event.target)) event.preventDefault(); }, { passive: false });
  const follow_pointer = event => {
    const [x, y] = pointed(event), seen = x >= xMin - reach && x <= xMax + reach && y >= yMin - reach && y <= yMax + reach;
    // a finger covers the map below it: show the place of the handle that it holds
    under = seen && event.pointerType !== 'touch' && !state.drag ? [x, y] : null;
    readout();
  };
  map.addEventListener('pointerleave', () => { under = null; readout(); });
  map.addEventListener('pointermove', event => {
    follow_pointer(event);
    if (!state.drag || event.pointerId !== state.drag.id) return;
    const { handle, dx, dy } = state.drag, [x, y] = pointed(event);
    moveTo(handle, x + dx, y + dy);
    changed();
  });
  const drop = event => {
    if (!state.drag || event.pointerId !== state.drag.id) return;
    const { before, handle } = state.drag;
    state.drag = null;
    last.what = null;
    remember(before);
    if (JSON.stringify(before) !== JSON.stringify(state.draft)) say(words(handle));
  };
  for (const event of ['pointerup', 'pointercancel', 'lostpointercapture']) map.addEventListener(event, drop);
  map.addEventListener('dblclick', event => { if (!handleOf(event.target)) addThreat(...pointed(event)); });
  map.addEventListener('focusin', event => {
    const found = handleOf(event.target);
    if (found) choose({ kind: found.kind, i: found.i, j: found.j });
  });
  const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  map.addEventListener('keydown', event => {
    const found = handleOf(event.target);
    if (!found || event.ctrlKey || event.metaKey || event.altKey) return;
    const { kind, i, j } = found, handle = { kind, i, j }, arrow = ARROWS[event.key];
    if (arrow) {
      const by = side * (event.shiftKey ? 0.001 : 0.01), [x, y] = placeOf(handle);
      step(`move ${JSON.stringify(handle)}`, () => moveTo(handle, x + arrow[0] * by, y + (yDown ? -1 : 1) * arrow[1] * by));
      say(words(handle));
    } else if (THREAT.has(kind) && (event.key === '+' || event.key === '-' || event.key === '=')) {
      step(`spread ${i}`, () => setSpread(i, state.draft.threats[i].spread * (event.key === '-' ? 1 / 1.05 : 1.05)));
      say(words(handle));
    } else if (event.key === 'Delete' || event.key === 'Backspace') remove(handle);
    else if (event.key === 'Escape') { choose(null); return; } else return;
    event.preventDefault();
  });
  // text fields undo their own text; sliders, buttons and lists have none, and the map is undone
  const TYPED = 'input:not([type=range], [type=checkbox], [type=radio], [type=button], [type=submit]), textarea, [contenteditable]:not([contenteditable=false])';
  document.addEventListener('keydown', event => {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || event.defaultPrevented || event.target.closest?.(TYPED)) return;
    // by the letter that is written on the key; by its place where that is no Latin one
    const key = /^[a-z]$/i.test(event.key) ? event.key.toLowerCase() : event.code.replace('Key', '').toLowerCase();
    if (key !== 'z' && key !== 'y') return;
    event.preventDefault();
    if (key === 'z' && !event.shiftKey) turn(state.undo, state.redo); else turn(state.redo, state.undo);
  });

  // ---- the panel
  $('#undo').addEventListener('click', () => turn(state.undo, state.redo));
  $('#redo').addEventListener('click', () => turn(state.redo, state.undo));
  $('#k').addEventListener('input', ({ target }) => step('k', () => { state.draft.k = Number((kTop * (target.value / 1000) ** 3).toPrecision(4)); }));
  entered($('#k-number'), () => {
    const node = $('#k-number'), k = Number(node.value);
    if (node.value === '' || !(k >= 0 && k <= 1e15)) node.value = state.draft.k;
    else if (k !== state.draft.k) step(null, () => { state.draft.k = k; });
  });
  $('#add-threat').addEventListener('click', () => {
    const line = state.answer?.path.length ? pairs(state.answer.path) : [[(xMin + xMax) / 2, (yMin + yMax) / 2]];
    addThreat(...line[line.length >> 1]);
  });
  $('#add-area').addEventListener('click', addArea);
  $('#theme').addEventListener('click', () => {
    const next = { auto: isDark() ? 'light' : 'dark', light: 'dark', dark: 'light' }[chosen.theme];
    setTheme(next);
    remembered(next);
    paint();
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', paint);
  for (const { name, summary } of given.solvers) $('#solver').append(el('option', { value: name, title: summary }, name));
  $('#solver').addEventListener('change', ({ target }) => {
    const name = target.value, free = [1, 2, 3, 4, 5, 6, 7].find(colour => !state.others.some(one => one.colour === colour));
    target.value = '';
    if (!name || state.others.some(one => one.name === name)) return;
    if (!free) { say('seven solvers beside hybrid are enough: remove one first'); return; }
    const one = { name, colour: free, answer: null, number: -1, seconds: null, busy: false, fast: given.solvers.find(solver => solver.name === name).fast };
    state.others.push(one);
    paint();
    compare(one);
  });
  $('#paths').addEventListener('click', ({ target }) => {
    if (!target.dataset.remove) return;
    state.others = state.others.filter(one => one.name !== target.dataset.remove);
    paint();
    $('#solver').focus();
  });
  // ---- saving: the server replaces a file only if it is the one that this page has read or written
  const fileName = place => place.split(/[\\/]/).at(-1);
  const versions = { [fileName(given.file)]: given.version };
  let kept = JSON.stringify(given.draft), name = given.name;
  const leaving = event => { event.preventDefault(); event.returnValue = true; };
  /** Say whether there is anything that is not saved. */
  function mark() {
    const is_new = JSON.stringify(state.draft) !== kept;
    document.title = `${is_new ? '• ' : ''}${name} – cgla live`;
    $('#unsaved').hidden = !is_new;
    if (is_new) addEventListener('beforeunload', leaving); else removeEventListener('beforeunload', leaving);
  }
  async function save(overwrite) {
    const draft = copy(), file = $('#file').value.trim() || fileName(given.file);
    const answer = await ask('save', { map: given.reading, read: versions[file] ?? '', draft, name: file, overwrite });
    $('#saved').textContent = answer.saved ? `Saved as ${answer.saved}` : answer.error;
    $('#saved').classList.toggle('failed', !answer.saved);
    $('#replace').hidden = !answer.taken;
    $('#replace').textContent = /^\S.* is gone:/.test(answer.error ?? '') ? 'Write it again' : 'Replace it';
    if (!answer.saved) return;
    versions[file] = answer.version;
    kept = JSON.stringify(draft);
    name = file.replace(/\.toml$/, '');
    $('#name').textContent = name;
    mark();
  }
  $('#save').addEventListener('submit', event => { event.preventDefault(); save(false); });
  $('#replace').addEventListener('click', () => save(true));
  $('#file').addEventListener('input', () => { $('#replace').hidden = true; });

  // ---- begin
  $('#name').textContent = given.name;
  $('#title').textContent = given.title;
  $('#file').value = fileName(given.file);
  // what tests and benchmarks look at
  const live = { latencies: [], state, get idle() { return !asking && !waiting && state.answered === state.number && !state.drag; } };
  window.live = live;
  new ResizeObserver(fit).observe(stage.parentElement);
  addEventListener('resize', fit);
  fit();
  changed();
})();
