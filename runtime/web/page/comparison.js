// Gauss-Seidel in the other half of the picture: its light, how wrong it is, and for how long.

const right = 0.01;  // of the light, in the area-weighted mean square

/** Counts the frames in which one side has not been right. */
class Lag {
  frames = 0;   // since it was right
  settled = 0;  // that the last change took

  add(error) {
    if (error > right) {
      ++this.frames;
    } else if (this.frames > 0) {
      this.settled = this.frames;
      this.frames = 0;
    }
  }
}

export class Comparison {
  sweeps = 1;
  milliseconds = 0;
  ours = { error: 0, lag: new Lag() };
  theirs = { error: 0, lag: new Lag() };
  #lighting;

  constructor(lighting, solver) {
    this.#lighting = lighting;
    this.solver = solver;
    this.twin = lighting.makeTwin();
    this.twin.mesh.visible = false;
  }

  /** One frame, after that of the lighting. */
  update() {
    const { milliseconds, error, engineError } = this.solver.sweep(this.#lighting.engine, this.sweeps);
    this.milliseconds += 0.1 * (milliseconds - this.milliseconds);
    for (const [side, now] of [[this.ours, engineError], [this.theirs, error]]) {
      side.error = now;
      side.lag.add(now);
    }
    this.twin.write(this.solver.vertexIrradiance());
  }

  dispose() {
    this.solver.dispose();
  }
}
