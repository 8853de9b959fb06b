// The force on the tool over the last seconds.
const SECONDS = 8;
const LEAST = 200; // mN that the axis shows at least

export class ForcePlot {
  #canvas;
  #points = []; // [ms, mN]

  constructor(canvas) {
    this.#canvas = canvas;
  }

  add(now, force) {
    this.#points.push([now, force]);
    while (this.#points[0][0] < now - 1000 * SECONDS) this.#points.shift();
  }

  draw(now) {
    const canvas = this.#canvas;
    const ratio = Math.min(window.devicePixelRatio, 2);
    const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const most = this.#points.reduce((sum, [, force]) => Math.max(sum, force), LEAST);
    const step = 10 ** Math.floor(Math.log10(most));
    const pen = canvas.getContext("2d");
    const y = (force) => height - (0.94 * height * force) / most - 1;
    pen.clearRect(0, 0, width, height);
    pen.font = `${10 * ratio}px system-ui, sans-serif`;
    pen.fillStyle = "#a9adb5";
    pen.strokeStyle = "#343945";
    for (const line of [most >= 5 * step ? 5 * step : most >= 2 * step ? 2 * step : step]) {
      pen.beginPath();
      pen.moveTo(0, y(line));
      pen.lineTo(width, y(line));
      pen.stroke();
      pen.fillText(`${line} mN`, 2 * ratio, y(line) + 11 * ratio);
    }
    pen.strokeStyle = "#f2b84b";
    pen.lineWidth = 1.5 * ratio;
    pen.beginPath();
    for (const [when, force] of this.#points) pen.lineTo(width * (1 - (now - when) / (1000 * SECONDS)), y(force));
    pen.stroke();
  }
}
