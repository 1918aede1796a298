// Sun and sky by the hour, as bright as lamps can stand up to.

const noonIlluminance = 6000;  // lx
const highest = 1.05;          // rad, the sun's altitude at noon

/** @returns {{sun: object|null, sky: object}} a light, null at night, and a sky */
export function sunAndSky(hour) {
  const day = Math.PI * (hour - 6) / 12;
  const altitude = highest * Math.sin(day);
  const up = Math.max(0, Math.sin(altitude));
  const around = day - Math.PI / 2;
  const direction = [
    -Math.sin(around) * Math.cos(altitude), -Math.sin(Math.max(altitude, 0.02)),
    Math.cos(around) * Math.cos(altitude) * -0.6,
  ];
  const low = Math.exp(-6 * up);  // light of a low sun is warm
  const sun = altitude <= 0 ? null : {
    type: 'directional', direction, color: [1, 1 - 0.42 * low, 1 - 0.75 * low],
    intensity: noonIlluminance * (1 - Math.exp(-5 * up)),
  };
  const dusk = Math.max(0.004, Math.min(1, (altitude + 0.1) / 0.35));
  const sky = {
    color: [0.38 + 0.4 * low * dusk, 0.62 + 0.08 * low * dusk, 1], luminance: 480 * dusk, type: 12,
    sunDirection: direction,
  };
  return { sun, sky };
}

/** The hour as a clock shows it. */
export function clockText(hour) {
  const minutes = Math.round(hour * 60);
  const two = (number) => String(number).padStart(2, '0');
  return `${two(Math.floor(minutes / 60))}:${two(minutes % 60)}`;
}
