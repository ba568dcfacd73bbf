// Draws what the document with the id "data" says, and keeps what the reader chose when that document changes.
'use strict';
(() => {
  const {
    $, all, el, isNumber, figure, percent, share, count, seconds, range, chosen, isDark, css, colourOf, infeasible, faint,
    remembered, setTheme, mapCanvases, riskBar, pointsOf, DASHES, SVG_DASHES,
  } = drawing;
  const MARKERS = ['circle', 'square', 'diamond', 'triangle-up', 'x', 'cross', 'star'];
  const MOST_BANDS = 6, POLL = 2000, PAPER = 660;
  const state = {
    data: JSON.parse($('#data').textContent), scenario: null, shown: new Set(), chosen: false,
    sort: { column: null, down: false }, filter: { text: '', scenario: '', solver: '', status: '' }, page: 0, size: 25, print: null,
  };

  // ---- pictures: drawn when first seen, and again when what they show has changed
  const plotlyHtml = text => String(text).replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;').replace(/[\r\n]+/g, ' ');
  const visible = new Set(), stale = new Set();
  function loadPlotly() {
    if (!window.Plotly) document.head.append(el('script', { textContent: $('#plotly').textContent }));
    return window.Plotly;
  }
  const holder = name => $(`[data-picture="${name}"]`);
  function redraw(...names) {
    for (const name of names.length ? names : Object.keys(PICTURES)) stale.add(name);
    for (const name of visible) draw(name);
  }
  function draw(name) {
    if (!stale.delete(name)) return;
    const box = holder(name), picture = PICTURES[name](box);
    box.setAttribute('aria-label', picture.label);
    const plotly = loadPlotly();
    all('.empty', box).forEach(node => node.remove());
    const coarse = matchMedia('(pointer: coarse)').matches;
    const axis = { gridcolor: css('line'), zerolinecolor: css('line'), linecolor: css('soft'), ticks: 'outside', tickcolor: css('line'), automargin: true };
    const layout = {
      paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)', showlegend: false, hovermode: 'closest',
      dragmode: coarse ? false : 'zoom', margin: { l: 48, r: 12, t: 12, b: 44 },
      font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: css('soft') },
      hoverlabel: { bgcolor: css('panel'), bordercolor: css('line'), font: { color: css('ink') }, align: 'left' },
      modebar: { bgcolor: 'rgba(0,0,0,0)', color: css('soft'), activecolor: css('accent') },
      ...(state.print ? { width: PAPER } : {}), ...picture.layout, xaxis: { ...axis, ...picture.layout.xaxis }, yaxis: { ...axis, ...picture.layout.yaxis },
    };
    plotly.react(box, picture.traces, layout, {
      responsive: true, displaylogo: false,
      modeBarButtons: [['toImage', 'zoom2d', 'pan2d', 'resetScale2d']],
    });
    if (!picture.traces.length) box.append(el('p', { className: 'empty' }, picture.empty || 'Nothing to show: no solver is chosen, or none has a path.'));
    const numbers = $(`[data-numbers="${name}"]`);
    if (numbers.open) fillNumbers(numbers);
  }
  const shown = place => state.shown.has(state.data.solvers[place]);
  const scenario = () => state.data.scenarios.find(one => one.name === state.scenario);
  const cells = () => {
    const here = scenario();
    return here ? state.data.order.map(place => here.cells.find(cell => cell.solver === place)).filter(Boolean) : [];
  };
  const look = (place, width = 2) => ({ color: colourOf(place), dash: DASHES[place % DASHES.length], width });
  const label = place => plotlyHtml(state.data.solvers[place]);
  const isOut = cell => cell.status === 'infeasible';

  const PICTURES = { map: mapPicture, curves: curvesPicture, success: successPicture, profile: profilePicture };

  /** Pictures that lie below the paths. */
  function mapImages(map) {
    const [xMin, yMin, xMax, yMax] = map.bounds, place = { x: xMin, y: map.y_down ? yMin : yMax, sizex: xMax - xMin, sizey: yMax - yMin };
    return mapCanvases(map).map(canvas => ({ source: canvas.toDataURL(), xref: 'x', yref: 'y', ...place, sizing: 'stretch', layer: 'below' }));
  }

  // plotly takes the letter of an exponent for a command of the path
  const plain = value => String(value).includes('e') ? value.toFixed(20) : value;
  function mapPicture(box) {
    const here = scenario();
    if (!here) return { traces: [], layout: {}, label: 'Map: no run is done yet', empty: 'No run is done yet.' };
    const map = state.data.maps[here.map];
    riskBar(map.risk);
    $('#risk-note').hidden = here.on_graph;
    $('#graph-note').hidden = !here.on_graph;
    $('#margin-note').hidden = !map.margin.length;
    if (!map.bounds) {
      box.style.height = '90px';
      return {
        traces: [], layout: { height: 90, xaxis: { visible: false }, yaxis: { visible: false } }, label: `${here.name}: no picture; the paths are in the table below`,
        empty: 'The nodes of this graph have no positions, so there is no picture: the paths are in the table below.',
      };
    }
    const [xMin, yMin, xMax, yMax] = map.bounds;
    const side = Math.max(xMax - xMin, yMax - yMin), points = flat => pointsOf(flat, map.bounds);
    // so that a long straight segment answers to the pointer everywhere
    const dense = list => list.flatMap(([x, y], i) => {
      if (!i) return [[x, y]];
      const [a, b] = list[i - 1], parts = Math.max(1, Math.ceil(Math.hypot(x - a, y - b) / side * 60));
      return Array.from({ length: parts }, (_, j) => [a + (x - a) * (j + 1) / parts, b + (y - b) * (j + 1) / parts]);
    });
    const drawn = cells().filter(cell => shown(cell.solver) && cell.path.length);
    // the best one comes last, on top and thinnest, so that paths that run one over the other are all seen
    const traces = drawn.reverse().map((cell, i) => {
      const line = dense(points(cell.path)), wide = drawn.length > 1 ? 2.4 + 2.6 * (1 - i / (drawn.length - 1)) : 3;
      const text = `<b>${label(cell.solver)}</b><br>${plotlyHtml(cell.status)}, ${cell.paths} of ${cell.runs} runs have a path<br>` +
        `cost ${figure(cell.cost[0])} · gap ${percent(cell.gap)}<br>${here.on_graph ? plotlyHtml(cell.nodes) : `length ${figure(cell.length)} · risk ${figure(cell.risk)}`}<br>time ${seconds(cell.seconds)}`;
      return {
        type: 'scatter', mode: 'lines', x: line.map(p => p[0]), y: line.map(p => p[1]), name: label(cell.solver),
        line: { ...look(cell.solver, wide), ...(isOut(cell) ? { color: infeasible(), dash: 'dot' } : {}) },
        text, hoverinfo: 'text', opacity: 0.92,
      };
    });
    const [start, goal] = points(here.ends);
    traces.push({
      type: 'scatter', mode: 'markers', x: [start[0], goal[0]], y: [start[1], goal[1]], text: ['start', 'goal'], hoverinfo: 'text', cliponaxis: false,
      marker: { symbol: ['circle', 'star'], size: [10, 14], color: css('paper'), line: { color: css('ink'), width: 2 } },
    });
    const ring = flat => 'M' + points(flat).map(([x, y]) => `${plain(x)},${plain(y)}`).join('L') + 'Z';
    const rings = map.no_fly.map(ring), margins = map.margin.map(ring);
    const edges = points(map.edges), net = which => edges.flatMap((end, i) => i % 2 ? [end[which], null] : [end[which]]);
    if (edges.length) traces.unshift({ type: 'scatter', mode: 'lines+markers', x: net(0), y: net(1), hoverinfo: 'skip', line: { color: css('soft'), width: 0.7 }, marker: { color: css('soft'), size: 4 }, opacity: 0.6 });
    const width = state.print ? PAPER : box.clientWidth || 600, height = Math.min(Math.max((width - 60) * (yMax - yMin) / (xMax - xMin) + 78, 280), 640);
    box.style.height = `${height}px`;
    const labels = which => map.axes ? { tickvals: map.axes[which][0], ticktext: map.axes[which][1] } : {};
    const pad = 0.02 * side, [low, high] = [yMin - pad, yMax + pad];
    return {
      traces, label: `Map of ${here.name}: ${drawn.length} paths shown; the numbers are in the list of solvers and in the table below`,
      layout: {
        height, uirevision: `${here.name}`, margin: { l: map.axes ? 64 : 44, r: 8, t: 26, b: 34 },
        xaxis: { range: [xMin - pad, xMax + pad], showgrid: false, zeroline: false, showline: false, constrain: 'domain', ...labels(0) },
        yaxis: { range: map.y_down ? [high, low] : [low, high], showgrid: false, zeroline: false, showline: false, scaleanchor: 'x', constrain: 'domain', ...labels(1) },
        images: mapImages(map),
        // above all paths, on paper of their own
        annotations: [['start', start], ['goal', goal]].map(([text, [x, y]]) => ({
          text, x, y, showarrow: false, yshift: 16, font: { color: css('ink'), size: 12 }, bgcolor: faint(isDark() ? '#14171c' : '#ffffff', 0.8), borderpad: 1,
        })),
        shapes: [
          ...(rings.length ? [{ type: 'path', path: rings.join(' '), fillrule: 'evenodd', fillcolor: css('wall'), line: { color: css('soft'), width: 0.8 }, layer: 'between' }] : []),
          ...(margins.length ? [{ type: 'path', path: margins.join(' '), line: { color: css('soft'), width: 1.2, dash: 'dash' }, layer: 'between' }] : []),
          { type: 'rect', x0: xMin, x1: xMax, y0: yMin, y1: yMax, line: { color: css('soft'), width: 1 }, layer: 'between' },
        ],
      },
    };
  }

  /** A line that holds each value until the next one, on to `end`; nothing where there is no value. */
  function stepLine(place, x, y, end, text) {
    const marks = x.map((_, i) => i === x.length - 1);
    return {
      type: 'scatter', mode: 'lines+markers', x: [...x, end], y: [...y, y.at(-1)], name: label(place), line: { ...look(place), shape: 'hv' },
      marker: { symbol: MARKERS[place % MARKERS.length], size: [...marks.map(mark => mark ? 7 : 0), 0], color: colourOf(place) },
      text: [...x.map((at, i) => text(at, y[i])), ''].map(line => line && `<b>${label(place)}</b><br>${line}`), hoverinfo: 'text',
    };
  }
  function stepBand(place, x, low, high, end, top) {
    const forth = [], back = [];
    for (let i = 0; i < x.length; i++) {
      if (!isNumber(low[i])) continue;
      const next = i + 1 < x.length ? x[i + 1] : end;
      forth.push([x[i], low[i]], [next, low[i]]);
      back.push([x[i], high[i] ?? top], [next, high[i] ?? top]);
    }
    const line = [...forth, ...back.reverse()];
    return {
      type: 'scatter', mode: 'lines', x: line.map(p => p[0]), y: line.map(p => p[1]), fill: 'toself',
      fillcolor: faint(colourOf(place), 0.13), line: { width: 0 }, hoverinfo: 'skip',
    };
  }
  const TIMES = [-6, -5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5];
  const timeAxis = () => ({
    type: 'log', title: { text: 'time' }, tickvals: TIMES.map(power => 10 ** power),
    ticktext: TIMES.map(power => power < -3 ? `${10 ** (power + 6)} µs` : power < 0 ? `${10 ** (power + 3)} ms` : `${count(10 ** power)} s`),
  });

  function curvesPicture() {
    const here = scenario(), drawn = cells().filter(cell => shown(cell.solver) && cell.curve && cell.curve.median.some(isNumber));
    if (!drawn.length) return { traces: [], layout: {}, label: 'Cost over time: nothing to show' };
    const end = 1.15 * Math.max(...drawn.map(cell => cell.curve.seconds.at(-1)));
    // gaps where a bound is known that no cost reaches, as in the picture; else costs
    const costs = drawn.flatMap(cell => cell.curve.median.filter(isNumber));
    const isGap = here.bound > 0 && Math.min(...costs) > here.bound * (1 + 1e-9);
    const worth = cost => isGap && isNumber(cost) ? 100 * Math.max(cost / here.bound - 1, 1e-9) : cost;
    const medians = costs.map(worth);
    const [least, most] = [Math.min(...medians, (!isGap && here.bound) || Infinity), Math.max(...medians)];
    const isLog = isGap || least > 0 && most > 4 * least, pad = 0.05 * (most - least) || 0.05 * Math.abs(most) || 1;
    const top = isLog ? most * 1.2 : most + pad, traces = [];
    if (drawn.length <= MOST_BANDS) {
      for (const { solver, curve } of drawn) {
        if (curve.low) traces.push(stepBand(solver, curve.seconds, curve.low.map(worth), curve.high.map(worth).map(value => isNumber(value) && value < top ? value : top), end, top));
      }
    }
    for (const { solver, curve } of drawn) {
      const from = curve.median.findIndex(isNumber);
      traces.push(stepLine(solver, curve.seconds.slice(from), curve.median.slice(from).map(worth), end, (at, value) => `${isGap ? `gap ${figure(value)} %` : `cost ${figure(value)}`} after ${seconds(at)}`));
    }
    const bottom = isLog ? least / Math.max((most / least) ** 0.1, 1.2) : least - 2 * pad;
    return {
      traces, label: `Cost over time on ${here.name} for ${drawn.length} solvers; the numbers are in the table below`,
      layout: {
        height: 380, uirevision: here.name, xaxis: timeAxis(),
        yaxis: { title: { text: isGap ? 'median gap (%)' : `median cost${here.unit && ` (${here.unit})`}` }, type: isLog ? 'log' : 'linear', range: isLog ? [Math.log10(bottom), Math.log10(top)] : [bottom, top], tickformat: '~g' },
        shapes: here.bound && !isGap ? [{ type: 'line', xref: 'paper', x0: 0, x1: 1, y0: here.bound, y1: here.bound, line: { color: css('soft'), width: 1, dash: 'dot' } }] : [],
        annotations: here.bound && !isGap ? [{ xref: 'paper', x: 0.005, y: isLog ? Math.log10(here.bound) : here.bound, xanchor: 'left', yanchor: 'top', showarrow: false, text: 'proven lower bound', font: { size: 11 } }] : [],
      },
    };
  }
  function successPicture() {
    const drawn = state.data.success.filter(one => shown(one.solver) && one.seconds.length);
    const end = 1.15 * Math.max(...drawn.map(one => one.seconds.at(-1)));
    const bands = drawn.length <= MOST_BANDS ? drawn.filter(one => one.low).map(one => stepBand(one.solver, one.seconds, one.low, one.high, end, 1)) : [];
    return {
      traces: [...bands, ...drawn.map(one => stepLine(one.solver, one.seconds, one.rate, end, (at, rate) => `${share(rate)} of the runs have a path after ${seconds(at)}`))],
      label: `Success over time of ${drawn.length} solvers; the numbers are in the table below`,
      layout: { height: 360, uirevision: 'success', xaxis: timeAxis(), yaxis: { title: { text: 'runs with a path' }, range: [-0.03, 1.04], tickformat: '.0%' } },
    };
  }
  function profilePicture() {
    const drawn = state.data.profile.filter(one => shown(one.solver) && one.factor.length);
    const most = Math.max(...drawn.map(one => one.factor.at(-1))), end = 1 + (most - 1) * 1.1 + 1e-3;
    return {
      traces: drawn.map(one => stepLine(one.solver, one.factor, one.share, end, (at, part) => `within ${figure(at, 4)} times the best on ${share(part)} of the scenarios`)),
      label: `Performance profile of ${drawn.length} solvers; the numbers are in the table below`,
      layout: {
        height: 360, uirevision: 'profile', yaxis: { title: { text: 'scenarios' }, range: [-0.03, 1.04], tickformat: '.0%' },
        xaxis: { title: { text: 'cost / cost of the best' }, type: most > 3 ? 'log' : 'linear', tickformat: '~g', nticks: 6 },
      },
    };
  }

  // ---- the same numbers as tables
  const at = (x, y, where, before = null) => x.reduce((found, moment, i) => moment <= where ? y[i] : found, before);
  const NUMBERS = {
    map: () => scenario()?.on_graph ? [['solver', 'path', 'status', 'runs with a path', 'median cost [95 %]', 'gap', 'time'], cells().map(cell => [
      state.data.solvers[cell.solver], cell.nodes || '–', cell.status, `${cell.paths}/${cell.runs}`, range(cell.cost, figure), percent(cell.gap), seconds(cell.seconds)])] : [['solver', 'status', 'runs with a path', 'median cost [95 %]', 'gap', 'length', 'risk', 'clearance', 'time'], cells().map(cell => [
      state.data.solvers[cell.solver], cell.status, `${cell.paths}/${cell.runs}`, range(cell.cost, figure), percent(cell.gap), figure(cell.length), figure(cell.risk), figure(cell.clearance, 3), seconds(cell.seconds)])],
    curves: () => [['solver', 'time to first path [95 %]', 'first median cost', 'last median cost', 'last change'], cells().map(cell => {
      const costs = cell.curve ? cell.curve.median : [], from = costs.findIndex(isNumber);
      return [state.data.solvers[cell.solver], range(cell.first, seconds), figure(costs[from]), figure(costs.at(-1)), from < 0 ? 'never' : seconds(cell.curve.seconds.at(-1))];
    })],
    success: () => [['solver', ...[0.01, 0.1, 1, 10].map(time => `after ${time} s`), 'at the end'], state.data.success.map(one => [
      state.data.solvers[one.solver], ...[0.01, 0.1, 1, 10, Infinity].map(time => share(at(one.seconds, one.rate, time, 0)))])],
    profile: () => [['solver', 'best', ...[1.01, 1.05, 1.2, 2].map(factor => `within ${factor}`), 'with a path'], state.data.profile.map(one => [
      state.data.solvers[one.solver], ...[1 + 1e-9, 1.01, 1.05, 1.2, 2, Infinity].map(factor => share(at(one.factor, one.share, factor, 0)))])],
  };
  function fillNumbers(details) {
    const [heads, lines] = NUMBERS[details.dataset.numbers]();
    const kind = i => i ? 'number' : '';
    $('.scroll', details).replaceChildren(el('table', {},
      el('thead', {}, el('tr', {}, ...heads.map((head, i) => el('th', { scope: 'col', className: kind(i) }, head)))),
      el('tbody', {}, ...lines.map(line => el('tr', {}, ...line.map((cell, i) => i ? el('td', { className: 'number' }, cell) : el('th', { scope: 'row' }, cell)))))));
  }

  // ---- what is shown
  function swatch(place, out) {
    const space = 'http://www.w3.org/2000/svg', svg = document.createElementNS(space, 'svg'), line = document.createElementNS(space, 'line');
    for (const [name, value] of Object.entries({ width: 34, height: 10, 'aria-hidden': true })) svg.setAttribute(name, value);
    for (const [name, value] of Object.entries({ x1: 1, x2: 33, y1: 5, y2: 5, 'stroke-width': 3, stroke: out ? infeasible() : colourOf(place), 'stroke-dasharray': out ? '2 3' : SVG_DASHES[place % SVG_DASHES.length] })) line.setAttribute(name, value);
    svg.append(line);
    return svg;
  }
  function fillLegends() {
    const here = new Map(cells().map(cell => [cell.solver, cell])), focused = document.activeElement?.dataset?.key;
    const item = (place, cell, group) => {
      const name = state.data.solvers[place];
      const box = el('input', { type: 'checkbox', checked: shown(place), value: name });
      box.dataset.key = `${group} ${name}`;
      const words = !cell ? [] : cell.paths && (cell.path.length || cell.nodes) && !isOut(cell) ? [isNumber(cell.gap) ? percent(cell.gap) : figure(cell.cost[0])] : [el('span', { className: 'none' }, cell.status)];
      const parts = group === 'map' ? [el('span', {}, ...words)] : [];
      return el('li', {}, el('label', { title: name }, box, swatch(place, cell && isOut(cell)), el('span', {}, name), ...parts));
    };
    $('#legend ul').replaceChildren(...state.data.order.filter(place => here.has(place)).map(place => item(place, here.get(place), 'map')));
    $('#legend-overall ul').replaceChildren(...state.data.order.map(place => item(place, null, 'overall')));
    if (focused) all('input[type=checkbox]').find(box => box.dataset.key === focused)?.focus();
  }
  function choose(names) {
    state.chosen = true;
    state.shown = new Set(names);
    for (const box of all('.legend input')) box.checked = state.shown.has(box.value);
    redraw();
  }
  function proofOf(here) { // a page that is served has no other files
    const { href, command, lower_bound: least } = here.proof_file;
    const bound = isNumber(least) ? `of the bound ${figure(least, 6)} ${here.unit}`.trim() : 'that there is no path';
    return [state.data.live ? 'proof' : el('a', { href }, 'proof'), ` ${bound}, checked by `, el('code', {}, command)];
  }
  function setScenario(name) {
    state.scenario = name;
    const list = state.data.scenarios, place = list.findIndex(one => one.name === name), here = list[place];
    $('#scenario').value = String(place);
    $('#previous').disabled = place <= 0;
    $('#next').disabled = place >= list.length - 1;
    $('#scenario-facts').textContent = !here ? '' : [here.title, isNumber(here.k) && `k = ${figure(here.k, 4).replace(/\.?0+$/, '')}`,
      here.unit_of_risk && `risk in ${here.unit_of_risk}`,
      here.unsolvable ? 'proven to have no path' : isNumber(here.bound) ? `lower bound ${figure(here.bound, 6)} ${here.unit}`.trim() : 'no lower bound', here.claims].filter(Boolean).join(' · ');
    if (here && here.proof_file) $('#scenario-facts').append(' · ', ...proofOf(here));
    fillLegends();
    redraw('map', 'curves');
    if (here && !state.data.maps[here.map].bounds) $('[data-numbers="map"]').open = true;
    for (const details of all('[data-numbers]')) if (details.open) fillNumbers(details);
  }
  const options = (select, words, first) => {
    const value = select.value;
    select.replaceChildren(...(first ? [el('option', { value: '' }, first)] : []), ...words.map(([key, text]) => el('option', { value: key }, text)));
    if (words.some(([key]) => key === value)) select.value = value;
  };

  // ---- the table of all runs
  const rows = () => state.data.rows;
  const status = i => state.data.statuses[rows().status[i]];
  const byName = (column, names) => { // places of names in the order of the alphabet
    const order = names.map((_, i) => i).sort((a, b) => names[a].localeCompare(names[b], 'en', { numeric: true })), rank = [];
    order.forEach((place, i) => { rank[place] = i; });
    return i => rank[rows()[column][i]];
  };
  // how numbers are written, by the format that the document names
  const WRITE = {
    plain: String, count, figure, percent, time: seconds, 'time-if-any': value => value ? seconds(value) : '–',
    memory: (value, digits) => `${figure(value, digits)} MiB`,
  };
  function columnOf({ key, head, kind, format, digits }) {
    const value = i => rows()[key][i];
    if (format === 'status') return { key, head, rank: () => value, text: i => status(i).label, kind: format };
    if (kind !== 'word') {
      const write = WRITE[format];
      return { key, head, rank: () => value, text: i => isNumber(value(i)) ? write(value(i), digits) : '–', kind: 'number' };
    }
    const words = () => ({ scenario: state.data.names, solver: state.data.solvers })[key] ?? rows().words[key];
    return { key, head, rank: () => byName(key, words()), text: i => words()[value(i)], kind: format };
  }
  const COLUMNS = state.data.columns.map(columnOf);
  // what the search looks into
  const WORDS = COLUMNS.filter(({ kind }) => kind !== 'number');
  let order = [], haystacks = null;
  function arrange() {
    const { text, ...chosen } = state.filter, words = text.toLowerCase().split(/\s+/).filter(Boolean), found = [];
    const wanted = [state.data.names.indexOf(chosen.scenario), state.data.solvers.indexOf(chosen.solver)];
    if (words.length) haystacks ??= rows().status.map((_, i) => WORDS.map(({ text: words }) => words(i)).join('\n').toLowerCase());
    for (let i = 0; i < rows().status.length; i++) {
      if (chosen.scenario && rows().scenario[i] !== wanted[0] || chosen.solver && rows().solver[i] !== wanted[1]) continue;
      if (chosen.status && (chosen.status === '!' ? status(i).is_path : status(i).label !== chosen.status)) continue;
      if (words.every(word => haystacks[i].includes(word))) found.push(i);
    }
    const column = COLUMNS.find(one => one.key === state.sort.column);
    if (column) {
      const rank = column.rank(), sign = state.sort.down ? -1 : 1;
      // what is no number comes last either way
      found.sort((a, b) => {
        const [x, y] = [rank(a), rank(b)];
        return isNumber(x) && isNumber(y) ? sign * (x - y) || a - b : isNumber(y) - isNumber(x) || a - b;
      });
    }
    order = found;
    fillTable();
  }
  function fillTable() {
    const pages = Math.max(1, Math.ceil(order.length / state.size));
    state.page = Math.min(Math.max(state.page, 0), pages - 1);
    const from = state.page * state.size, here = order.slice(from, from + state.size);
    $('#table tbody').replaceChildren(...here.map(i => el('tr', {}, ...COLUMNS.map(({ text, kind }) => {
      const words = text(i);
      if (kind === 'status') return el('td', {}, el('span', { className: `status ${status(i).is_path ? 'good' : 'bad'}`, title: status(i).sentence }, words));
      return el('td', { className: kind, ...(kind === 'number' ? {} : { title: words }) }, words);
    }), rerunCell(rows().number[i]))));
    const total = count(rows().status.length);
    $('#count').textContent = order.length ? `${count(from + 1)}–${count(from + here.length)} of ${count(order.length)}${order.length < rows().status.length ? ` (${total} in all)` : ''}` : `None of ${total} runs`;
    for (const button of all('[data-page]')) button.disabled = ['first', 'previous'].includes(button.dataset.page) ? state.page === 0 : state.page >= pages - 1;
    for (const head of all('#table th[data-key]')) {
      if (head.dataset.key === state.sort.column) head.setAttribute('aria-sort', state.sort.down ? 'descending' : 'ascending');
      else head.removeAttribute('aria-sort');
    }
  }
  function rerunCell(row) {
    if (!isNumber(row)) return el('td', {}, '–');
    const command = `${state.data.rerun} ${row}`;
    const button = el('button', { type: 'button', title: command, 'aria-label': `Copy the command that runs row ${row} again` }, 'copy');
    button.dataset.command = command;
    return el('td', {}, button);
  }
  async function copy(button) {
    try {
      await navigator.clipboard.writeText(button.dataset.command);
    } catch { // where the clipboard is closed to pages
      const area = el('textarea', { value: button.dataset.command, className: 'hidden' });
      document.body.append(area);
      area.select();
      document.execCommand('copy');
      area.remove();
      button.focus();
    }
    button.textContent = 'copied';
    setTimeout(() => { button.textContent = 'copy'; }, 1500);
  }
  function setFilter(name, value) {
    state.filter[name] = value;
    state.page = 0;
    arrange();
  }

  // ---- everything anew, when the page begins and when its data have changed
  function fill() {
    const { data } = state;
    haystacks = null;
    if (!state.chosen) state.shown = new Set(data.first.map(place => data.solvers[place]));
    options($('#scenario'), data.scenarios.map((one, i) => [String(i), one.name]));
    options($('#filter-scenario'), data.names.map(name => [name, name]), 'all');
    options($('#filter-solver'), data.solvers.map(name => [name, name]), 'all');
    // of one scenario, a profile has one step
    $('#profile').hidden = data.scenarios.length < 2;
    $('#profile').parentElement.classList.toggle('halves', !$('#profile').hidden);
    const used = new Set(rows().status);
    options($('#filter-status'), [['!', 'without a path'], ...data.statuses.filter((_, i) => used.has(i)).map(one => [one.label, one.label])], 'all');
    setScenario(scenario() ? state.scenario : data.scenarios[0]?.name ?? null);
    arrange();
    redraw();
    markWide();
  }

  // ---- a hint where there is more to the right
  function markWide() {
    for (const box of all('.scroll')) {
      const wide = box.scrollWidth > box.clientWidth + 2;
      box.classList.toggle('wider', wide);
      box.classList.toggle('ended', wide && box.scrollLeft + box.clientWidth >= box.scrollWidth - 2);
    }
  }

  // ---- while a study runs
  let known = null;
  function swapParts(page) {
    for (const part of all('[data-live]')) {
      const fresh = page.getElementById(part.id);
      if (!fresh || fresh.innerHTML === part.innerHTML.replace(/(class="scroll)(?: wider| ended)+/g, '$1')) continue;
      const open = all('details[open]', part).map(node => node.dataset.key), sideways = all('.scroll', part).map(node => node.scrollLeft);
      const focused = part.contains(document.activeElement) ? all('button, summary, .scroll', part).indexOf(document.activeElement) : -1;
      part.replaceChildren(...fresh.childNodes);
      for (const node of all('details', part)) node.open = open.includes(node.dataset.key);
      all('.scroll', part).forEach((node, i) => { node.scrollLeft = sideways[i] || 0; });
      if (focused >= 0) all('button, summary, .scroll', part)[focused]?.focus({ preventScroll: true });
    }
  }
  async function poll() {
    const chip = $('#live'), began = performance.now();
    try {
      const now = await (await fetch('state', { cache: 'no-store' })).json();
      if (now.stamp !== known && (known !== null || now.runs !== state.data.runs || now.complete !== state.data.complete)) {
        const page = new DOMParser().parseFromString(await (await fetch(location.pathname, { cache: 'no-store' })).text(), 'text/html');
        state.data = JSON.parse(page.getElementById('data').textContent);
        document.title = page.title;
        swapParts(page);
        fill();
      }
      // a page from before the last run is asked for again
      if (now.runs === state.data.runs) known = now.stamp;
      chip.textContent = now.complete ? 'complete' : `live: ${count(now.runs)} of ${count(now.cells)}`;
      chip.classList.remove('off');
    } catch {
      chip.textContent = 'not connected';
      chip.classList.add('off');
    }
    setTimeout(poll, Math.max(POLL, 4 * (performance.now() - began)));
  }

  // ---- what the reader does
  function listen() {
    const on = (selector, event, act) => $(selector).addEventListener(event, act);
    on('#theme', 'click', () => {
      // the other one, then that of the system, then back to whatever the system has
      const ofSystem = matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light', other = ofSystem === 'dark' ? 'light' : 'dark';
      const next = chosen.theme === 'auto' ? other : chosen.theme === other ? ofSystem : 'auto';
      setTheme(next);
      remembered(next);
      fillLegends();
      redraw();
    });
    on('#scenario', 'change', event => setScenario(state.data.scenarios[Number(event.target.value)].name));
    for (const [id, by] of [['#previous', -1], ['#next', 1]]) {
      on(id, 'click', () => setScenario(state.data.scenarios[Number($('#scenario').value) + by].name));
    }
    for (const legend of all('.legend')) {
      legend.addEventListener('change', ({ target }) => choose(target.checked ? [...state.shown, target.value] : [...state.shown].filter(name => name !== target.value)));
    }
    on('#legend', 'click', ({ target }) => {
      const names = { all: state.data.solvers, best: state.data.order.slice(0, 5).map(place => state.data.solvers[place]), none: [] }[target.dataset.show];
      if (names) choose(names);
    });
    for (const details of all('[data-numbers]')) details.addEventListener('toggle', () => details.open && fillNumbers(details));
    $('#table thead tr').append(...COLUMNS.map(({ key, head, kind }) => {
      const cell = el('th', { scope: 'col', className: kind === 'number' ? 'number' : '' }, el('button', { type: 'button' }, head));
      cell.dataset.key = key;
      return cell;
    }), el('th', { scope: 'col' }, el('span', { className: 'hidden' }, 'run it again')));
    on('#table thead', 'click', ({ target }) => {
      const column = target.closest('th')?.dataset.key;
      if (!column || target.tagName !== 'BUTTON') return;
      state.sort = { column, down: state.sort.column === column && !state.sort.down };
      state.page = 0;
      arrange();
    });
    on('#table tbody', 'click', ({ target }) => { if (target.dataset.command) copy(target); });
    addEventListener('resize', markWide);
    document.addEventListener('toggle', markWide, true);
    document.addEventListener('scroll', markWide, { capture: true, passive: true });
    let waiting = 0;
    on('#filter-text', 'input', ({ target }) => { clearTimeout(waiting); waiting = setTimeout(() => setFilter('text', target.value), 120); });
    for (const name of ['scenario', 'solver', 'status']) on(`#filter-${name}`, 'change', ({ target }) => setFilter(name, target.value));
    on('#filters', 'submit', event => event.preventDefault());
    on('#filters', 'reset', () => { state.filter = { text: '', scenario: '', solver: '', status: '' }; state.page = 0; arrange(); });
    on('#size', 'change', ({ target }) => { state.size = Number(target.value); state.page = 0; fillTable(); });
    for (const button of all('[data-page]')) {
      button.addEventListener('click', () => {
        state.page = { first: 0, previous: state.page - 1, next: state.page + 1, last: Infinity }[button.dataset.page];
        fillTable();
      });
    }
    on('#failures', 'click', ({ target }) => {
      if (!target.classList.contains('show-runs')) return;
      $('#filters').reset();
      for (const name of ['solver', 'status']) { $(`#filter-${name}`).value = target.dataset[name]; state.filter[name] = target.dataset[name]; }
      arrange();
      $('#runs').scrollIntoView();
      $('#filter-text').focus({ preventScroll: true });
    });
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => { if (chosen.theme === 'auto') { fillLegends(); redraw(); } });
    addEventListener('beforeprint', () => {
      state.print = chosen.theme;
      setTheme('light');
      fillLegends();
      for (const name of Object.keys(PICTURES)) { stale.add(name); draw(name); }
    });
    addEventListener('afterprint', () => {
      setTheme(state.print);
      state.print = null;
      fillLegends();
      redraw();
    });
    const watcher = new IntersectionObserver(entries => {
      for (const { target, isIntersecting } of entries) {
        const name = target.dataset.picture;
        if (!isIntersecting) { visible.delete(name); continue; }
        visible.add(name);
        draw(name);
      }
    }, { rootMargin: '200px' });
    for (const box of all('[data-picture]')) watcher.observe(box);
  }

  setTheme(remembered() ?? 'auto');
  listen();
  fill();
  if (state.data.live) poll();
})();
