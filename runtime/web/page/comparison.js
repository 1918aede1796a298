// What the other half of the picture can show, how wrong it is, and for how long.

const right = 0.01;  // of the light, in the area-weighted mean square

/** Counts the frames in which one side has not been right. */
export class Lag {
  frames = 0;   // since it was right
  settled = 0;  // that the last change took

  /** One frame, in which it is right or not. */
  add(isRight) {
    if (!isRight) {
      ++this.frames;
    } else if (this.frames > 0) {
      this.settled = this.frames;
      this.frames = 0;
    }
  }
}

/** One half: its error against the converged solution of the frame, and its lag. */
export class Side {
  error = NaN;
  lag = new Lag();

  add(error) {
    this.error = error;
    this.lag.add(error <= right);
  }
}

const twins = new WeakMap();

/** The twin of a lighting: one, as it stays as long as the lighting does. */
function twinOf(lighting) {
  if (!twins.has(lighting)) twins.set(lighting, lighting.makeTwin());
  return twins.get(lighting);
}

/** Gauss-Seidel, which goes on from its last solution. */
export class GaussSeidel {
  kind = 'gauss-seidel';
  title = 'Gauss-Seidel';
  pace = 1;       // sweeps a frame
  mostPace = 8;
  milliseconds = 0;
  ours = new Side();
  theirs = new Side();
  #lighting;
  #twin;

  constructor(stage, solver) {
    this.#lighting = stage.lighting;
    this.solver = solver;
    this.#twin = twinOf(stage.lighting);
    this.objects = [this.#twin.mesh];
  }

  get paceText() {
    return `${this.pace} ${this.pace === 1 ? 'sweep' : 'sweeps'} a frame`;
  }

  get note() {
    return `${this.milliseconds.toFixed(1)} ms`;
  }

  /** One frame, after that of the lighting. */
  update() {
    this.ours.add(this.solver.converge(this.#lighting.engine));
    const { milliseconds, error } = this.solver.sweep(this.#lighting.engine, this.pace);
    this.milliseconds += 0.1 * (milliseconds - this.milliseconds);
    this.theirs.add(error);
    this.#twin.write(this.solver.vertexIrradiance());
  }

  /** To be called around the drawing of its half; the result draws what follows as before. */
  begin() {
    return () => {};
  }

  dispose() {
    this.solver.dispose();
  }
}
