// What the report and the page of cgla live draw alike: numbers as text, colours, risk as a picture. One object, `drawing`.
'use strict';
const drawing = (() => {
  const $ = (selector, root = document) => root.querySelector(selector);
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];
  // names and messages are only ever set as text
  const el = (tag, attributes = {}, ...children) => {
    const node = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name in node && name !== 'list') node[name] = value; else node.setAttribute(name, value);
    }
    node.append(...children);
    return node;
  };

  // the colours of the pictures that `cgla compare` writes, and the same ones for dark paper
  const LIGHT = ['#0072B2', '#E69F00', '#56B4E9', '#000000', '#009E73', '#CC79A7', '#7A3B00', '#999933'];
  const DARK = ['#4BA3E3', '#F0B429', '#9AD5F5', '#FFFFFF', '#2CC295', '#E3A0C6', '#C98B55', '#C5C55A'];
  const DASHES = ['solid', 'dash', 'dot', 'dashdot', 'longdash'];
  const SVG_DASHES = ['', '7 4', '2 3', '7 3 2 3', '11 4'];
  const STEPS = 99999;
  // white to violet in equal steps of lightness on light paper, near-black to violet on dark
  const RISK_LIGHT = [[255, 255, 255], [199, 186, 227], [146, 122, 200], [100, 69, 175]];
  const RISK_DARK = [[27, 31, 38], [62, 52, 98], [108, 83, 172], [168, 140, 240]];
  const NEGATIVE = [157, 180, 192];

  // ---- numbers as text
  const isNumber = value => value !== null && value !== undefined;
  const figure = (value, digits = 5) => {
    if (!isNumber(value)) return '–';
    const text = Number(value).toPrecision(digits);
    return text.includes('e') ? String(Number(text)) : text;
  };
  const percent = value => isNumber(value) ? (value >= 0 ? '+' : '−') + Math.abs(100 * value).toFixed(2) + ' %' : '–';
  const share = value => isNumber(value) ? (100 * value).toFixed(value > 0 && value < 1 ? 1 : 0) + ' %' : '–';
  const count = value => isNumber(value) ? value.toLocaleString('en') : '–';
  const seconds = value => {
    if (!isNumber(value)) return 'never';
    if (value === 0) return '0 s';
    if (value > 0 && value < 1e-3) return figure(1e6 * value, 3) + ' µs';
    return value < 1 ? figure(1e3 * value, 3) + ' ms' : figure(value, 3) + ' s';
  };
  const range = (found, write) => isNumber(found[1]) || isNumber(found[2]) && found[0] !== null
    ? `${write(found[0])} [${isNumber(found[1]) ? write(found[1]) : '−∞'}, ${isNumber(found[2]) ? write(found[2]) : '∞'}]`
    : isNumber(found[0]) ? write(found[0]) : 'never';

  // ---- colours
  const chosen = { theme: 'auto' };
  const isDark = () => chosen.theme === 'dark' || chosen.theme === 'auto' && matchMedia('(prefers-color-scheme: dark)').matches;
  const probe = el('span', { hidden: true });
  document.body.append(probe);
  const css = name => { probe.style.color = `var(--${name})`; return getComputedStyle(probe).color; };
  const colourOf = number => (isDark() ? DARK : LIGHT)[number % LIGHT.length];
  const infeasible = () => isDark() ? '#FF8A4C' : '#D55E00';
  const faint = (colour, opacity) => colour + Math.round(255 * opacity).toString(16).padStart(2, '0');
  const remembered = (value) => {
    // storage may be forbidden, as for files in some browsers
    try {
      if (value === undefined) return localStorage.getItem('cgla-report-theme');
      localStorage.setItem('cgla-report-theme', value);
    } catch { /* then it lasts as long as the page */ }
    return null;
  };
  const THEMES = { auto: ['Auto', 'as the system has them'], light: ['Light', 'light'], dark: ['Dark', 'dark'] };
  function setTheme(theme) {
    chosen.theme = theme in THEMES ? theme : 'auto';
    if (chosen.theme === 'auto') delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = chosen.theme;
    const [word, sentence] = THEMES[chosen.theme];
    $('#theme').textContent = word;
    $('#theme').setAttribute('aria-label', `Colours: ${sentence}`);
  }

  // ---- risk
  function riskColours() {
    const stops = isDark() ? RISK_DARK : RISK_LIGHT;
    return at => {
      if (at < 0) return NEGATIVE;
      const place = Math.min(at, 1) * (stops.length - 1), first = Math.min(Math.floor(place), stops.length - 2);
      return stops[first].map((low, i) => Math.round(low + (place - first) * (stops[first + 1][i] - low)));
    };
  }
  /** A raster, its rows from the least y on, on a canvas of its own; `rgba` is asked for the colour of each number. */
  function rasterCanvas({ rows: height, columns: width }, numbers, rgba, yDown) {
    const canvas = el('canvas', { width, height }), context = canvas.getContext('2d');
    const image = context.createImageData(width, height);
    for (let row = 0; row < height; row++) {
      const from = (yDown ? row : height - 1 - row) * width;
      for (let column = 0; column < width; column++) image.data.set(rgba(numbers[from + column]), 4 * (row * width + column));
    }
    context.putImageData(image, 0, 0);
    return canvas;
  }
  const bytes = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
  /** How strong the colour is at a share of the scale; negative risk has strengths below 0. */
  const strength = (risk, share) => risk.low < 0 ? (risk.low + share * (risk.top - risk.low)) / risk.top : share;
  /** The colours of risk, by their place among 256 from `low` to `top`. */
  function riskShades(risk) {
    const colours = riskColours();
    return Array.from({ length: 256 }, (_, level) => [...colours(strength(risk, level / 255)), 255]);
  }
  /** Risk (its levels as bytes), and the walls of a map that has them, as canvases over its bounds. */
  function mapCanvases({ risk, walls, y_down: yDown }) {
    const grey = css('wall').match(/[\d.]+/g).slice(0, 3).map(Number), shades = risk && riskShades(risk);
    return [
      ...(risk ? [rasterCanvas(risk, typeof risk.levels === 'string' ? bytes(risk.levels) : risk.levels, level => shades[level], yDown)] : []),
      ...(walls ? [rasterCanvas(walls, bytes(walls.quarters), quarters => [...grey, Math.round(255 * quarters / 4)], yDown)] : []),
    ];
  }
  /** Steps from the lower left corner, x, y, x, y, …, as points in map units. */
  const pointsOf = (flat, [xMin, yMin, xMax, yMax]) => {
    const step = Math.max(xMax - xMin, yMax - yMin) / STEPS;
    return flat.reduce((list, value, i) => (i % 2 ? list.at(-1).push(yMin + value * step) : list.push([xMin + value * step]), list), []);
  };
  function riskBar(risk) {
    const bar = $('#risk-bar');
    bar.hidden = !risk;
    if (!risk) return;
    const context = $('canvas', bar).getContext('2d'), colours = riskColours(), [low, top, unit] = all('span', bar);
    for (let x = 0; x < 256; x++) {
      context.fillStyle = `rgb(${colours(strength(risk, x / 255))})`;
      context.fillRect(x, 0, 1, 1);
    }
    [low.textContent, top.textContent] = [figure(risk.low, 3).replace(/^0\.0+$/, '0'), figure(risk.top, 3)];
    // few cells far riskier than all others: the colours' steps are not equal
    const half = risk.top * 0.5 ** (1 / risk.power);
    unit.textContent = `${risk.label ?? 'risk per unit length'}${risk.power < 1 ? ` (colours by its cube root: ${figure(half, 3)} in the middle)` : ''}`;
  }

  return {
    $, all, el, isNumber, figure, percent, share, count, seconds, range, chosen, isDark, css, colourOf, infeasible, faint,
    remembered, setTheme, rasterCanvas, riskShades, mapCanvases, riskBar, pointsOf, bytes, DASHES, SVG_DASHES,
  };
})();
