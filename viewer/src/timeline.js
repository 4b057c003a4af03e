// The bands under the scrub bar: what each end does, and where the rod touches.
import { COLORS } from './markers.js';

const css = (color) => `#${color.toString(16).padStart(6, '0')}`;

export function drawBands(canvas, motion) {
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth, clientHeight } = canvas;
  if (!clientWidth || !motion.states || motion.duration <= 0) return;
  canvas.width = Math.round(clientWidth * ratio);
  canvas.height = Math.round(clientHeight * ratio);
  const context = canvas.getContext('2d');
  const { offsets } = motion.contacts;
  let most = 1;
  for (let k = 0; k + 1 < offsets.length; ++k) most = Math.max(most, offsets[k + 1] - offsets[k]);
  const row = canvas.height / 3;
  for (let x = 0; x < canvas.width; ++x) {
    const time = motion.start + ((x + 0.5) / canvas.width) * motion.duration;
    motion.ends(time).forEach((role, k) => {
      context.fillStyle = css(COLORS[role]);
      context.globalAlpha = role === 'free' ? 0.25 : role === 'held' ? 0.55 : 1;
      context.fillRect(x, k * row, 1, row - ratio);
    });
    const [from, to] = motion.contactRange(time);
    if (to > from) {
      context.fillStyle = css(COLORS.contact);
      context.globalAlpha = 0.35 + 0.65 * ((to - from) / most);
      context.fillRect(x, 2 * row, 1, row - ratio);
    }
  }
}
