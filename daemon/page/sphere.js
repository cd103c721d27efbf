// The frames of a capture on the sphere: where each is, how it is, which are chosen, and from where one looks at them.
// Nothing here draws or knows the page.
//
// 1. Frames are numbered as the API numbers them: shot × cameras + camera.
// 2. The world is the capture's: +Z up. One looks from outside at the centre, in parallel, from `azimuth` and `tilt`
//    (radians); screen coordinates are those of a square with the sphere's radius as unit, x right, y down.

// What may become of a frame; the order is that of the legend, `weight` says which is seen where two coincide.
export const KINDS = [
    { letter: "p", name: "planned", weight: 0, side: "open" },
    { letter: "w", name: "way", weight: 1, side: "open" },
    { letter: "s", name: "stored", weight: 2, side: "open" },
    { letter: "t", name: "again", weight: 4, side: "open" },
    { letter: "a", name: "good", weight: 3, side: "good" },
    { letter: "n", name: "retaken", weight: 3, side: "good" },
    { letter: "f", name: "soft", weight: 5, side: "bad" },
    { letter: "c", name: "clipped", weight: 6, side: "bad" },
    { letter: "r", name: "rejected", weight: 7, side: "bad" },
    { letter: "m", name: "missing", weight: 8, side: "bad" },
];
const KIND_OF = new Map(KINDS.map((kind, index) => [kind.letter, index]));

// What the states of frames in events mean where no letter comes with them.
const LETTER_OF_STATE = {
    planned: "p", triggered: "w", exposed: "w", received: "w", stored: "s", accepted: "a", rejected: "r", missing: "m",
};
export function letterOfState(state) {
    return LETTER_OF_STATE[state] ?? null;
}

const SAME = 1e-9; // squared distance of two frames taken from one place
const TILT_MOST = Math.PI / 2;

export class Sphere {
    constructor() {
        this.azimuth = -Math.PI / 2;
        this.tilt = 0.35;
        this.zoom = 1;
        this.load({ capture: "", cameras: [], shots: 0, names: [], directions: [], letters: "" });
    }

    load(frames) {
        const count = frames.cameras.length * frames.shots;
        const same = this.capture === frames.capture && this.count === count;

        this.capture = frames.capture;
        this.cameras = frames.cameras;
        this.shots = frames.shots;
        this.names = frames.names;
        this.count = count;
        this.directions = new Float32Array(3 * count);
        this.kinds = new Uint8Array(count);
        this.counts = new Int32Array(KINDS.length);
        if (!same)
            this.chosen = new Set();
        for (let i = 0; i < count; i++) {
            this.directions.set(frames.directions[i] ?? [0, 0, 0], 3 * i);
            this.kinds[i] = KIND_OF.get(frames.letters[i]) ?? 0;
            this.counts[this.kinds[i]]++;
        }
        this.numbers = new Map(this.names.map((name, i) => [name, i]));
        this.turns = this.findTurns();
    }

    // False where there is no such frame, or nothing new.
    set(number, letter) {
        const kind = KIND_OF.get(letter);

        if (kind === undefined || !(number >= 0 && number < this.count) || this.kinds[number] === kind)
            return false;
        this.counts[this.kinds[number]]--;
        this.counts[kind]++;
        this.kinds[number] = kind;
        return true;
    }

    shotOf(number) {
        return Math.floor(number / this.cameras.length);
    }

    cameraOf(number) {
        return number % this.cameras.length;
    }

    direction(number) {
        return this.directions.subarray(3 * number, 3 * number + 3);
    }

    sum(side) {
        return KINDS.reduce((sum, kind, i) => (kind.side === side ? sum + this.counts[i] : sum), 0);
    }

    *bad() {
        for (let i = 0; i < this.count; i++) {
            if (KINDS[this.kinds[i]].side === "bad")
                yield i;
        }
    }

    // ---- what is chosen ----

    choose(numbers, on = true) {
        for (const number of numbers) {
            if (on)
                this.chosen.add(number);
            else
                this.chosen.delete(number);
        }
    }

    // Those of these kinds (names) in addition; returns how many there are.
    chooseKinds(names) {
        let found = 0;

        for (let i = 0; i < this.count; i++) {
            if (names.includes(KINDS[this.kinds[i]].name)) {
                this.chosen.add(i);
                found++;
            }
        }
        return found;
    }

    chosenNames() {
        return [...this.chosen].sort((a, b) => a - b).map((number) => this.names[number]);
    }

    // ---- from where one looks ----

    turn(byAzimuth, byTilt) {
        this.azimuth = wrap(this.azimuth + byAzimuth);
        this.tilt = Math.min(TILT_MOST, Math.max(-TILT_MOST, this.tilt + byTilt));
    }

    enlarge(factor) {
        this.zoom = Math.min(8, Math.max(0.8, this.zoom * factor));
    }

    lookAt(direction) {
        const [x, y, z] = direction;

        if (Math.hypot(x, y) > 1e-6)
            this.azimuth = Math.atan2(y, x);
        this.tilt = Math.atan2(z, Math.hypot(x, y));
    }

    // Rows: to the right, down, towards who looks.
    matrix() {
        const ca = Math.cos(this.azimuth), sa = Math.sin(this.azimuth), ct = Math.cos(this.tilt), st = Math.sin(this.tilt);

        return [-sa, ca, 0, st * ca, st * sa, -ct, ct * ca, ct * sa, st];
    }

    // ---- picking ----

    // The frame nearest to a point of the near half, and those taken from the same place; [] where none is within reach.
    pick(x, y, reach) {
        let best = -1, least = reach * reach;

        this.eachSeen((number, px, py) => {
            const distance = (px - x) ** 2 + (py - y) ** 2;
            if (distance < least) {
                least = distance;
                best = number;
            }
        });
        return best < 0 ? [] : this.sameAs(best);
    }

    pickWithin(x0, y0, x1, y1) {
        const found = [];

        this.eachSeen((number, x, y) => {
            if (x >= Math.min(x0, x1) && x <= Math.max(x0, x1) && y >= Math.min(y0, y1) && y <= Math.max(y0, y1))
                found.push(number);
        });
        return found;
    }

    eachSeen(see) {
        const m = this.matrix(), d = this.directions;

        for (let i = 0; i < this.count; i++) {
            const x = d[3 * i], y = d[3 * i + 1], z = d[3 * i + 2];
            if (m[6] * x + m[7] * y + m[8] * z > -0.05)
                see(i, m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z);
        }
    }

    sameAs(number) {
        const [x, y, z] = this.direction(number), d = this.directions, found = [];

        for (let i = 0; i < this.count; i++) {
            if ((d[3 * i] - x) ** 2 + (d[3 * i + 1] - y) ** 2 + (d[3 * i + 2] - z) ** 2 < SAME)
                found.push(i);
        }
        return found;
    }

    // ---- rows and the arm ----

    // First shots of the turns, where the platform goes round more than once; of twelfths where it does not.
    findTurns() {
        const starts = [0];
        let turned = 0;

        for (let shot = 1; shot < this.shots; shot++) {
            turned += wrap(this.yaw(shot) - this.yaw(shot - 1));
            if (Math.abs(turned) > 2 * Math.PI - 1e-3) {
                starts.push(shot);
                turned = 0;
            }
        }
        if (starts.length > 1)
            return { whole: true, starts };
        const step = Math.max(1, Math.ceil(this.shots / 12));
        return { whole: false, starts: Array.from({ length: Math.ceil(this.shots / step) }, (_, i) => i * step) };
    }

    // Of the platform in a shot, but for a constant: by the camera that is furthest from the axis.
    yaw(shot) {
        const cameras = this.cameras.length;

        if (this.yawCamera === undefined || this.yawOf !== this.directions) {
            let least = 2;
            this.yawOf = this.directions;
            for (let camera = 0; camera < cameras; camera++) {
                const up = Math.abs(this.directions[3 * camera + 2]);
                if (up < least) {
                    least = up;
                    this.yawCamera = camera;
                }
            }
        }
        const d = this.direction(shot * cameras + this.yawCamera);
        return Math.atan2(d[1], d[0]);
    }

    // Directions of the cameras where the arm is: as the board says; where it does not know the turn, those of the nearest
    // shot, turned to the arm's yaw. `shot`: the one taken last, for an arm that is not known and to tell the turns apart.
    arm(arm, shot) {
        if (!this.count)
            return [];
        if (arm?.cameras?.length)
            return arm.cameras;
        let at = Math.min(Math.max(shot, 0), this.shots - 1), by = 0;
        if (arm && Number.isFinite(arm.yaw)) {
            // The first position is at yaw 0 of its turn.
            const away = (s) => wrap(arm.yaw - (this.yaw(s) - this.yaw(0)));
            const near = this.nearShots(at);
            at = near.reduce((best, s) => (Math.abs(away(s)) < Math.abs(away(best)) ? s : best), near[0]);
            by = away(at);
        }
        return this.cameras.map((_, camera) => turned(this.direction(at * this.cameras.length + camera), by));
    }

    // The shots of the turn that a shot lies in.
    nearShots(shot) {
        if (!this.turns.whole)
            return Array.from({ length: this.shots }, (_, i) => i);
        const starts = this.turns.starts;
        const turn = starts.findLastIndex((start) => start <= shot);
        const end = starts[turn + 1] ?? this.shots;
        return Array.from({ length: end - starts[turn] }, (_, i) => starts[turn] + i);
    }
}

export function wrap(angle) {
    return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

function turned(d, by) {
    const c = Math.cos(by), s = Math.sin(by);

    return [c * d[0] - s * d[1], s * d[0] + c * d[1], d[2]];
}
