// The scenes of the page, and how they are lit at first. Lengths in metres, intensities in candela.

const warm = '#ffd2a1', blue = '#9cc4ff';

export const scenes = [
  {
    id: 'cornell_box',
    title: 'Box',
    darkEmitters: true,
    lampRadius: 0.012,
    lamps: [{ position: [0.2, 0.42, 0.2], color: warm, intensity: 4 }],
    ball: { position: [0.42, 0.33, 0.2], radius: 0.04 },
    target: [0.278, 0.27, 0.28],
    camera: [0.278, 0.275, -0.78],
    fov: 40,
  },
  {
    id: 'furnished_room',
    title: 'Room',
    lampRadius: 0.05,
    lamps: [
      { position: [1.2, 1.9, 1.2], color: warm, intensity: 160 },
      { position: [1.1, 0.95, 2.75], color: blue, intensity: 40 },
    ],
    ball: { position: [2.3, 1.2, 1.6], radius: 0.17 },
  },
  {
    id: 'pavilion',
    title: 'Pavilion',
    lampRadius: 0.1,
    hour: 18.6,
    lamps: [{ position: [1, 1.5, 0.5], color: warm, intensity: 2500 }],
    ball: { position: [2, 1, 1.6], radius: 0.35 },
  },
];
