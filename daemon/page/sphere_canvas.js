// The sphere on a plain canvas, for browsers without WebGL: the same marks, from behind to the front.
import { KINDS } from "./sphere.js";
import { ARM, CELL, sprites } from "./sphere_sprites.js";

const CIRCLES = 11; // parallels and meridians that are drawn, in 48 pieces

export class CanvasSphere {
    static create(canvas) {
        const context = canvas.getContext("2d");

        return context ? new CanvasSphere(canvas, context) : null;
    }

    constructor(canvas, context) {
        this.mode = "canvas";
        this.canvas = canvas;
        this.context = context;
        this.arm = [];
    }

    setColours(palette) {
        this.palette = palette;
        this.sheet = sprites(palette);
    }

    setFrames(sphere) {
        this.sphere = sphere;
        this.order = null;
    }

    // Where two frames coincide the worse one is drawn last.
    update(arm) {
        const { count, kinds } = this.sphere;
        const byKind = KINDS.map(() => []);

        this.arm = arm;
        for (let i = 0; i < count; i++)
            byKind[kinds[i]].push(i);
        this.order = KINDS.map((kind, index) => [kind.weight, byKind[index]])
            .sort((a, b) => a[0] - b[0]).flatMap(([, numbers]) => numbers);
    }

    draw({ matrix, radius, size }) {
        const { context, canvas } = this;

        context.setTransform(1, 0, 0, 1, 0, 0);
        context.clearRect(0, 0, canvas.width, canvas.height);
        context.translate(canvas.width / 2, canvas.height / 2);
        this.drawGrid(matrix, radius);
        this.drawFrames(matrix, radius, size, false);
        this.drawFrames(matrix, radius, size, true);
        this.drawArm(matrix, radius, size);
    }

    place(m, d, radius) {
        return [radius * (m[0] * d[0] + m[1] * d[1] + m[2] * d[2]), radius * (m[3] * d[0] + m[4] * d[1] + m[5] * d[2]),
            m[6] * d[0] + m[7] * d[1] + m[8] * d[2]];
    }

    circle(m, radius, of) {
        const { context } = this;

        for (let i = 0; i < 48; i++) {
            const [x0, y0, z0] = this.place(m, of(i * Math.PI / 24), radius);
            const [x1, y1] = this.place(m, of((i + 1) * Math.PI / 24), radius);
            context.globalAlpha = z0 > 0 ? 0.5 : 0.15;
            context.beginPath();
            context.moveTo(x0, y0);
            context.lineTo(x1, y1);
            context.stroke();
        }
    }

    drawGrid(m, radius) {
        const { context } = this;

        context.strokeStyle = this.palette.line;
        context.lineWidth = 1;
        for (let line = 0; line < CIRCLES; line++) {
            const a = line * Math.PI / 6, t = (line - 8) * Math.PI / 6;
            this.circle(m, radius, line < 6
                ? (s) => [Math.cos(s) * Math.cos(a), Math.cos(s) * Math.sin(a), Math.sin(s)]
                : (s) => [Math.cos(t) * Math.cos(s), Math.cos(t) * Math.sin(s), Math.sin(t)]);
        }
        context.globalAlpha = 1;
    }

    sprite(column, row, x, y, side) {
        this.context.drawImage(this.sheet, column * CELL, row * CELL, CELL, CELL, x - side / 2, y - side / 2, side, side);
    }

    drawFrames(m, radius, size, front) {
        const { context, sphere } = this, { directions, kinds, chosen } = sphere;
        const side = size * 1.4 * (front ? 1 : 0.62);

        context.globalAlpha = front ? 1 : 0.26;
        for (const i of this.order ?? []) {
            const [x, y, z] = this.place(m, directions.subarray(3 * i, 3 * i + 3), radius);
            if (z > 0 === front)
                this.sprite(kinds[i], chosen.has(i) ? 1 : 0, x, y, side);
        }
        context.globalAlpha = 1;
    }

    drawArm(m, radius, size) {
        const { context } = this, places = this.arm.map((d) => this.place(m, d, radius));

        context.strokeStyle = this.palette.arm;
        context.lineWidth = 2;
        places.forEach(([x, y, z], i) => {
            context.globalAlpha = z > 0 ? 1 : 0.3;
            if (i) {
                context.beginPath();
                context.moveTo(places[i - 1][0], places[i - 1][1]);
                context.lineTo(x, y);
                context.stroke();
            }
            this.sprite(ARM, 0, x, y, size * 1.4 * (z > 0 ? 1 : 0.62));
        });
        context.globalAlpha = 1;
    }

    destroy() {
    }
}
