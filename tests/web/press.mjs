// The steps of press.c in the module: the same poses, the same numbers.
export function press(upt, model, { steps, corrections, each = () => {} }) {
  const scene = model.scene({ stepSeconds: 0.02, corrections: corrections || "recommended" });
  const [x, y, z] = model.positions().slice(3 * model.indices("domainNodes")[0]);
  const states = [];
  for (let step = 0; step < steps; step += 1) {
    const down = step < 16 ? step : step < 24 ? 16 : 40 - step;
    const aside = step < 16 ? 0 : step < 24 ? step - 16 : 8;
    const ball = [{ position: [x + 0.5 * aside, y, z + 6 - 0.5 * down], radius: 6, friction: 0.25 }];
    const moved = scene.step(ball).slice();
    each(scene.timing());
    states.push(moved, Float32Array.from(scene.readings()[0].force), scene.present(0.007, ball).slice());
  }
  scene.close();
  return states;
}
