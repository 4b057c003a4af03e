// What the address may say: page.html#t=0.5&view=35,20&still=1 (a query string works as well).
//
//   t=F             fraction of the motion's duration, 0 to 1          time=S       or seconds
//   still=1         no panels, nothing but the picture                play=1       start playing
//   view=A,E[,Z]    azimuth, elevation (degrees), zoom; or front, side, top
//   fit=rod         frame the rod's motion rather than everything     up=x|y|z     what is up
//   opacity=F       of the obstacles                                  section=x,F[,flip]  section plane
//   onion=N         show N positions along the way                    ghosts=0, names=0, edges=0, grippers=0, contacts=0

const VIEWS = { front: [0, 0], side: [90, 0], top: [0, 89.9] };
export const DEFAULT_VIEW = [32, 24];

function numbers(text) {
  const values = text.split(',').map(Number);
  return values.every(Number.isFinite) ? values : null;
}

export function viewNamed(name) {
  return VIEWS[name] ?? DEFAULT_VIEW;
}

export function readOptions(location) {
  const given = new URLSearchParams(location.search);
  for (const [key, value] of new URLSearchParams(location.hash.slice(1))) given.set(key, value);
  const number = (key) => (given.has(key) && Number.isFinite(Number(given.get(key))) ? Number(given.get(key)) : undefined);
  const off = (key) => given.get(key) === '0';
  const view = given.get('view');
  const section = given.get('section')?.split(',');
  return {
    fraction: number('t'),
    time: number('time'),
    still: given.get('still') === '1',
    play: given.get('play') === '1',
    view: view ? (VIEWS[view] ?? numbers(view) ?? DEFAULT_VIEW) : DEFAULT_VIEW,
    fit: given.get('fit') === 'rod' ? 'rod' : 'all',
    up: ['x', 'y', 'z'].includes(given.get('up')) ? given.get('up') : undefined,
    opacity: number('opacity'),
    section: section && ['x', 'y', 'z'].includes(section[0])
      ? { axis: section[0], at: Number(section[1] ?? 0.5) || 0, flipped: section[2] === 'flip' } : undefined,
    onion: number('onion') ?? 0,
    ghosts: !off('ghosts'), names: !off('names'), edges: !off('edges'), grippers: !off('grippers'), contacts: !off('contacts'),
  };
}
