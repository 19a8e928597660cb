// SPDX-License-Identifier: Apache-2.0
// The measurement behind the pictures: one record per pixel of the page, unpacked from the layers
// (see report_layers.hpp for their order and encoding).
const page = JSON.parse(element('page-data').textContent);

const measured = {
  pixels: page.width * page.height,
  disparity_q8: null,   // 256 (x_left - x_right), where hasDisparity
  reason: null,
  confidence: null,
  sigmaDisparity: null, // 1/256 px
  sigmaLength: null,    // logarithmic, see sigmaLengthOf
  truth_q8: null,       // as disparity_q8, NO_TRUTH where unknown; null without truth
};
const NO_TRUTH = 0x7fffff;

// Whether a pixel has a disparity; a depth has only one whose reason is 0.
const hasDisparity = (index) =>
  measured.reason[index] === 0 || measured.reason[index] === page.reason_beyond;

async function inflate(text) {
  const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Undoes the row-wise differences of a 24-bit layer kept as three planes, low byte first.
function unpackDifferences(bytes, offset) {
  const values = new Int32Array(measured.pixels);
  const n = measured.pixels;
  for (let y = 0, i = 0; y < page.height; y++) {
    let value = 0;
    for (let x = 0; x < page.width; x++, i++) {
      value += bytes[offset + i] | bytes[offset + n + i] << 8 | bytes[offset + 2 * n + i] << 16;
      value = value << 8 >> 8;  // 24 bits, signed
      values[i] = value;
    }
  }
  return values;
}

async function loadLayers() {
  const bytes = await inflate(element('page-layers').textContent);
  const n = measured.pixels;
  measured.disparity_q8 = unpackDifferences(bytes, 0);
  measured.reason = bytes.subarray(3 * n, 4 * n);
  measured.confidence = bytes.subarray(4 * n, 5 * n);
  measured.sigmaDisparity = bytes.subarray(5 * n, 6 * n);
  measured.sigmaLength = bytes.subarray(6 * n, 7 * n);
  if (page.has_truth) measured.truth_q8 = unpackDifferences(bytes, 7 * n);
}

const sigmaLengthOf = (code) => page.sigma_first * Math.pow(page.sigma_ratio, code - 1);

// The point of a measured pixel in the left camera's frame, into result[at..at+2].
function pointOf(index, result, at) {
  const column = index % page.width, row = (index - column) / page.width;
  const x = column * page.step, y = row * page.step;
  const shift = measured.disparity_q8[index] / 256 - (page.cx_left - page.cx_right);
  const z = page.f * page.baseline / shift;
  const px = (x - page.cx_left) / page.f * z, py = (y - page.cy) / page.fy * z;
  const R = page.R_left_rect;
  result[at] = R[0] * px + R[1] * py + R[2] * z;
  result[at + 1] = R[3] * px + R[4] * py + R[5] * z;
  result[at + 2] = R[6] * px + R[7] * py + R[8] * z;
}

// A length with about four significant digits: "812.4 mm", "3.214 m".
function lengthText(length) {
  if (page.unit !== 'mm') return `${Number(length.toPrecision(4))} ${page.unit}`;
  const size = Math.abs(length);
  if (size >= 10000) return `${(length / 1000).toFixed(size >= 100000 ? 1 : 2)} m`;
  return `${length.toFixed(size >= 1000 ? 0 : size >= 100 ? 1 : size >= 10 ? 2 : 3)} mm`;
}

function fixedLength(length, sigma) {
  const digits = sigma > 0 ? Math.min(3, Math.max(0, Math.ceil(-Math.log10(sigma)) + 1)) : 1;
  return length.toFixed(digits);
}
