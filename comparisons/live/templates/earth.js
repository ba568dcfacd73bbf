// Places on a map in degrees: its projection (azimuthal equidistant on WGS84) and how longitudes and latitudes are written.
'use strict';
const earth = (() => {
  const A = 6378137, F = 1 / 298.257223563, B = A * (1 - F), RADIANS = Math.PI / 180;

  /** The place that lies so many metres east and north of an origin, degrees: Vincenty's series, below a millimetre. */
  function inverse([longitude, latitude], [east, north]) {
    const s = Math.hypot(east, north);
    if (s === 0) return [longitude, latitude];
    const sinA = east / s, cosA = north / s, tanU = (1 - F) * Math.tan(latitude * RADIANS);
    const cosU = 1 / Math.hypot(1, tanU), sinU = tanU * cosU, sigma1 = Math.atan2(tanU, cosA), sinAlpha = cosU * sinA, cos2 = 1 - sinAlpha ** 2;
    const u2 = cos2 * (A * A - B * B) / (B * B);
    const k1 = (Math.sqrt(1 + u2) - 1) / (Math.sqrt(1 + u2) + 1), a = (1 + k1 ** 2 / 4) / (1 - k1), b = k1 * (1 - 3 * k1 ** 2 / 8);
    let sigma = s / (B * a), m = 0;
    for (let round = 0; round < 20; round++) {
      m = Math.cos(2 * sigma1 + sigma);
      const sin = Math.sin(sigma), cos = Math.cos(sigma);
      const delta = b * sin * (m + b / 4 * (cos * (2 * m * m - 1) - b / 6 * m * (4 * sin * sin - 3) * (4 * m * m - 3)));
      const next = s / (B * a) + delta, change = Math.abs(next - sigma);
      sigma = next;
      if (change < 1e-15) break;
    }
    m = Math.cos(2 * sigma1 + sigma);
    const sin = Math.sin(sigma), cos = Math.cos(sigma), away = sinU * sin - cosU * cos * cosA;
    const phi = Math.atan2(sinU * cos + cosU * sin * cosA, (1 - F) * Math.hypot(sinAlpha, away));
    const lambda = Math.atan2(sin * sinA, cosU * cos - sinU * sin * cosA), c = F / 16 * cos2 * (4 + F * (4 - 3 * cos2));
    const turned = lambda - (1 - c) * F * sinAlpha * (sigma + c * sin * (m + c * cos * (2 * m * m - 1)));
    return [wrapped(longitude + turned / RADIANS), phi / RADIANS];
  }

  /** The metres east and north of an origin of a place in degrees: where `inverse` gives the place; null if none is found. */
  function forward(origin, [longitude, latitude]) {
    const far = Math.PI * B, cosine = Math.cos(latitude * RADIANS);
    const turn = wrapped(longitude - origin[0]) * RADIANS, [p, q] = [origin[1] * RADIANS, latitude * RADIANS];
    // on a sphere first, then by Newton's method
    const arc = Math.atan2(Math.hypot(Math.cos(q) * Math.sin(turn), Math.cos(p) * Math.sin(q) - Math.sin(p) * Math.cos(q) * Math.cos(turn)), Math.sin(p) * Math.sin(q) + Math.cos(p) * Math.cos(q) * Math.cos(turn));
    const azimuth = Math.atan2(Math.cos(q) * Math.sin(turn), Math.cos(p) * Math.sin(q) - Math.sin(p) * Math.cos(q) * Math.cos(turn));
    let at = [6371008 * arc * Math.sin(azimuth), 6371008 * arc * Math.cos(azimuth)];
    const off = ([x, y]) => {
      const [u, v] = inverse(origin, [x, y]);
      return [wrapped(longitude - u) * RADIANS * Math.max(cosine, 1e-9) * A, (latitude - v) * RADIANS * A];
    };
    for (let round = 0; round < 30; round++) {
      const [dx, dy] = off(at), size = Math.hypot(dx, dy);
      if (size < 1e-6) return at;
      const h = 1, [ax, ay] = off([at[0] + h, at[1]]), [bx, by] = off([at[0], at[1] + h]);
      const [a, b, c, d] = [(ax - dx) / h, (bx - dx) / h, (ay - dy) / h, (by - dy) / h], det = a * d - b * c;
      if (!(Math.abs(det) > 1e-9)) break;
      at = [at[0] - (d * dx - b * dy) / det, at[1] - (a * dy - c * dx) / det];
      if (!(Math.hypot(...at) <= 1.01 * far)) break;
    }
    const [dx, dy] = off(at);
    return Math.hypot(dx, dy) < 1e-3 ? at : null;
  }
  const wrapped = longitude => Math.abs(longitude) <= 180 ? longitude : ((longitude + 180) % 360 + 360) % 360 - 180;

  /** A longitude (letters EW) or latitude (NS) with a number of digits. */
  const text = (value, letters, digits) => {
    const number = Math.abs(value).toFixed(digits);
    return Number(number) === 0 || letters === 'EW' && Number(number) === 180 ? `${number}°` : `${number}° ${letters[value < 0 ? 1 : 0]}`;
  };
  return { inverse, forward, wrapped, text };
})();
