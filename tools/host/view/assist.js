// SPDX-License-Identifier: Apache-2.0
// Marks and figures that are computed from the picture's pixels.

/** Grey values of one half of ImageData. */
function greyOf(image, side) {
  const width = image.width >> 1;
  const grey = new Uint8Array(width * image.height);
  for (let y = 0, to = 0; y < image.height; y++) {
    for (let x = 0, at = 4 * (y * image.width + side * width); x < width; x++, at += 4) {
      grey[to++] = (77 * image.data[at] + 150 * image.data[at + 1] + 29 * image.data[at + 2] + 128) >> 8;
    }
  }
  return {width, height: image.height, data: grey};
}

/** Green where edges are steep (peaking), red stripes where the light is clipped (zebra). */
function markPixels(image, peaking, zebra) {
  const {width, height, data} = image;
  const marks = new ImageData(width, height);
  const paint = new Uint32Array(marks.data.buffer);
  const green = 0xff40ff20, red = 0xff2030ff;
  const steep = 48, clipped = 252;
  for (let y = 0; y < height - 1; y++) {
    for (let x = 0, at = y * width; x < width - 1; x++, at++) {
      const p = 4 * at;
      if (zebra && (data[p] >= clipped || data[p + 1] >= clipped || data[p + 2] >= clipped)) {
        if ((x + y) % 6 < 3) paint[at] = red;
      } else if (peaking && Math.abs(data[p + 1] - data[p + 5]) + Math.abs(data[p + 1] - data[p + 1 + 4 * width]) > steep) {
        paint[at] = green;
      }
    }
  }
  return marks;
}

/** Share of clipped and dark pixels, and counts of 64 levels. */
function levelsOf(grey) {
  const counts = new Uint32Array(64);
  for (let i = 0; i < grey.data.length; i++) counts[grey.data[i] >> 2]++;
  const all = grey.data.length;
  let clipped = 0;
  for (let i = 0; i < all; i++) clipped += grey.data[i] >= 252;
  return {counts, clipped: clipped / all};
}

/** Mean squared gradient over the squared mean (Tenengrad, of any brightness), in 1/1000. */
function focusOf(grey, region) {
  let sum = 0, light = 0, count = 0;
  const right = Math.min(region.x + region.w, grey.width - 1), bottom = Math.min(region.y + region.h, grey.height - 1);
  for (let y = Math.max(1, region.y); y < bottom; y++) {
    for (let x = Math.max(1, region.x); x < right; x++) {
      const at = y * grey.width + x;
      const dx = grey.data[at + 1] - grey.data[at - 1], dy = grey.data[at + grey.width] - grey.data[at - grey.width];
      sum += dx * dx + dy * dy; light += grey.data[at]; count++;
    }
  }
  return count && light ? 1000 * (sum / count) / (light / count) ** 2 : 0;
}

const colourOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Draws curves [{values, colour, fill}] over the whole canvas, from 0 to the largest. */
function plot(canvas, curves) {
  const context = canvas.getContext('2d');
  const {width, height} = canvas;
  const top = Math.max(1e-9, ...curves.flatMap((c) => [...c.values]));
  context.clearRect(0, 0, width, height);
  for (const {values, colour} of curves) {
    context.beginPath();
    context.strokeStyle = colour;
    context.lineWidth = 2;
    values.forEach((value, i) => context.lineTo(i / Math.max(1, values.length - 1) * width, height - 3 - value / top * (height - 8)));
    context.stroke();
  }
}

const focusCurve = [[], []];
function showAssist(image, region) {
  const halves = [greyOf(image, 0), greyOf(image, 1)];
  const levels = halves.map(levelsOf);
  const colours = [colourOf('--accent'), colourOf('--fair')];
  plot(element('histogram'), levels.map((l, i) => ({values: Array.from(l.counts, Math.sqrt), colour: colours[i]})));
  element('light').textContent = 'Clipped: left ' + (100 * levels[0].clipped).toFixed(1) + ' %, right ' + (100 * levels[1].clipped).toFixed(1) + ' %';
  if (!region) return;
  halves.forEach((half, i) => { focusCurve[i].push(focusOf(half, region)); if (focusCurve[i].length > 200) focusCurve[i].shift(); });
  element('curve').hidden = false;
  plot(element('curve'), focusCurve.map((values, i) => ({values, colour: colours[i]})));
  element('sharp').textContent = 'Focus of ' + region.w + ' × ' + region.h + ' px: left ' + focusCurve[0].at(-1).toFixed(2) + ' (best ' + Math.max(...focusCurve[0]).toFixed(2) + '), right ' + focusCurve[1].at(-1).toFixed(2) + ' (best ' + Math.max(...focusCurve[1]).toFixed(2) + ')';
}
