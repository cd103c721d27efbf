// The sphere by WebGL, 1 or 2: all frames are points of one draw call, their marks come from the picture of sphere_sprites.js.
// A lost context is told by `lost`; when it comes back everything is made anew. null where there is no WebGL.
import { KINDS } from "./sphere.js";
import { ARM, COLUMNS, ROWS, rgb, sprites } from "./sphere_sprites.js";

const POINT_VERTEX = `
attribute vec3 place;
attribute vec2 look; // column of the sprite, row
uniform mat3 turn;
uniform vec2 scale;
uniform float size;
uniform float weights[${ARM + 1}];
varying vec2 cell;
varying float shade;
void main() {
    vec3 at = turn * place;
    float near = smoothstep(-0.12, 0.12, at.z);
    gl_Position = vec4(at.x * scale.x, at.y * scale.y, -0.8 * at.z - 0.002 * weights[int(look.x)], 1.0);
    gl_PointSize = size * mix(0.62, 1.0, near) * 1.4;
    cell = look;
    shade = mix(0.26, 1.0, near);
}`;
const POINT_FRAGMENT = `
precision mediump float;
uniform sampler2D sheet;
varying vec2 cell;
varying float shade;
void main() {
    vec4 texel = texture2D(sheet, (floor(cell + 0.5) + gl_PointCoord) / vec2(${COLUMNS}.0, ${ROWS}.0));
    if (texel.a < 0.25)
        discard;
    gl_FragColor = texel * shade;
}`;
const LINE_VERTEX = `
attribute vec3 place;
uniform mat3 turn;
uniform vec2 scale;
varying float depth;
void main() {
    vec3 at = turn * place;
    gl_Position = vec4(at.x * scale.x, at.y * scale.y, -0.8 * at.z, 1.0);
    depth = at.z;
}`;
const LINE_FRAGMENT = `
precision mediump float;
uniform vec4 colour;
varying float depth;
void main() {
    gl_FragColor = vec4(colour.rgb, 1.0) * colour.a * (depth > 0.0 ? 1.0 : 0.3);
}`;

function program(gl, vertex, fragment) {
    const made = gl.createProgram();

    for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(type);
        gl.shaderSource(shader, text);
        gl.compileShader(shader);
        gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost())
        throw new Error(gl.getProgramInfoLog(made) ?? "a shader cannot be linked");
    const at = { program: made };
    for (const name of ["turn", "scale", "size", "weights", "sheet", "colour"])
        at[name] = gl.getUniformLocation(made, name);
    for (const name of ["place", "look"])
        at[name] = gl.getAttribLocation(made, name);
    return at;
}

// Meridians and parallels, every 30 degrees, as pairs of ends.
export function graticule() {
    const ends = [], on = (a, t) => [Math.cos(t) * Math.cos(a), Math.cos(t) * Math.sin(a), Math.sin(t)];
    const step = Math.PI / 36;

    for (let line = 0; line < 12; line++) {
        for (let i = -18; i < 18; i++)
            ends.push(...on(line * 6 * step, i * step), ...on(line * 6 * step, (i + 1) * step));
    }
    for (let line = -2; line <= 2; line++) {
        for (let i = 0; i < 72; i++)
            ends.push(...on(i * step, line * 6 * step), ...on((i + 1) * step, line * 6 * step));
    }
    return new Float32Array(ends);
}

export class GlSphere {
    static create(canvas, lost) {
        const options = { antialias: true, alpha: true, premultipliedAlpha: true, powerPreference: "low-power" };
        const gl = canvas.getContext("webgl2", options) ?? canvas.getContext("webgl", options);

        return gl ? new GlSphere(canvas, gl, lost) : null;
    }

    constructor(canvas, gl, lost) {
        this.mode = "webgl";
        this.canvas = canvas;
        this.gl = gl;
        this.palette = null;
        this.sphere = null;
        this.stop = new AbortController();
        canvas.addEventListener("webglcontextlost", (event) => {
            event.preventDefault(); // otherwise it never comes back
            lost(true);
        }, { signal: this.stop.signal });
        canvas.addEventListener("webglcontextrestored", () => {
            this.make();
            this.setColours(this.palette);
            this.setFrames(this.sphere);
            lost(false);
        }, { signal: this.stop.signal });
        this.make();
    }

    make() {
        const gl = this.gl;

        this.points = program(gl, POINT_VERTEX, POINT_FRAGMENT);
        this.lines = program(gl, LINE_VERTEX, LINE_FRAGMENT);
        this.grid = graticule();
        this.buffers = { grid: gl.createBuffer(), arm: gl.createBuffer(), place: gl.createBuffer(), look: gl.createBuffer() };
        gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.grid);
        gl.bufferData(gl.ARRAY_BUFFER, this.grid, gl.STATIC_DRAW);
        this.sheet = gl.createTexture();
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
        gl.depthFunc(gl.LEQUAL);
    }

    setColours(palette) {
        const gl = this.gl;

        this.palette = palette;
        gl.bindTexture(gl.TEXTURE_2D, this.sheet);
        gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, true);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, sprites(palette));
        gl.generateMipmap(gl.TEXTURE_2D);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    }

    setFrames(sphere) {
        this.sphere = sphere;
        this.places = new Float32Array(3 * (sphere.count + sphere.cameras.length));
        this.places.set(sphere.directions);
        this.looks = new Uint8Array(2 * (sphere.count + sphere.cameras.length));
    }

    // After frames have changed or been chosen; `arm`: directions of the cameras now.
    update(arm) {
        const gl = this.gl, { count, kinds, chosen } = this.sphere, looks = this.looks;
        const shown = Math.min(arm.length, looks.length / 2 - count);

        for (let i = 0; i < count; i++) {
            looks[2 * i] = kinds[i];
            looks[2 * i + 1] = 0;
        }
        for (const number of chosen)
            looks[2 * number + 1] = 1;
        for (let i = 0; i < shown; i++) {
            looks[2 * (count + i)] = ARM;
            this.places.set(arm[i], 3 * (count + i));
        }
        gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.place);
        gl.bufferData(gl.ARRAY_BUFFER, this.places, gl.DYNAMIC_DRAW);
        gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.look);
        gl.bufferData(gl.ARRAY_BUFFER, looks, gl.DYNAMIC_DRAW);
        gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.arm);
        gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(arm.flat()), gl.DYNAMIC_DRAW);
        this.armCount = arm.length;
        this.pointCount = count + shown;
    }

    // `radius`, `size` (of a mark): pixels of the canvas.
    draw({ matrix, radius, size }) {
        const gl = this.gl, { width, height } = this.canvas;
        // GLSL's matrices are told by columns, and up is up.
        const m = matrix, turn = [m[0], -m[3], m[6], m[1], -m[4], m[7], m[2], -m[5], m[8]];
        const scale = [2 * radius / width, 2 * radius / height];

        if (gl.isContextLost())
            return;
        gl.viewport(0, 0, width, height);
        gl.clearColor(0, 0, 0, 0);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        gl.disable(gl.DEPTH_TEST);
        gl.useProgram(this.lines.program);
        gl.uniformMatrix3fv(this.lines.turn, false, turn);
        gl.uniform2fv(this.lines.scale, scale);
        this.drawLines(this.buffers.grid, this.grid.length / 3, this.palette.line, 0.5, gl.LINES);
        if (this.armCount > 1)
            this.drawLines(this.buffers.arm, this.armCount, this.palette.arm, 1, gl.LINE_STRIP);
        gl.enable(gl.DEPTH_TEST);
        this.drawPoints(turn, scale, size);
    }

    drawLines(buffer, count, colour, alpha, how) {
        const gl = this.gl;

        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.enableVertexAttribArray(this.lines.place);
        gl.vertexAttribPointer(this.lines.place, 3, gl.FLOAT, false, 0, 0);
        gl.uniform4f(this.lines.colour, ...rgb(colour), alpha);
        gl.drawArrays(how, 0, count);
        gl.disableVertexAttribArray(this.lines.place);
    }

    drawPoints(turn, scale, size) {
        const gl = this.gl, at = this.points;

        gl.useProgram(at.program);
        gl.uniformMatrix3fv(at.turn, false, turn);
        gl.uniform2fv(at.scale, scale);
        gl.uniform1f(at.size, size);
        gl.uniform1fv(at.weights, [...KINDS.map((kind) => kind.weight), ARM]);
        gl.bindTexture(gl.TEXTURE_2D, this.sheet);
        gl.uniform1i(at.sheet, 0);
        gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.place);
        gl.enableVertexAttribArray(at.place);
        gl.vertexAttribPointer(at.place, 3, gl.FLOAT, false, 0, 0);
        gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.look);
        gl.enableVertexAttribArray(at.look);
        gl.vertexAttribPointer(at.look, 2, gl.UNSIGNED_BYTE, false, 0, 0);
        gl.drawArrays(gl.POINTS, 0, this.pointCount);
        gl.disableVertexAttribArray(at.place);
        gl.disableVertexAttribArray(at.look);
    }

    destroy() {
        this.stop.abort();
        this.gl.getExtension("WEBGL_lose_context")?.loseContext();
    }
}
