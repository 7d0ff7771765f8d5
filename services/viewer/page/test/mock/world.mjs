// A forest and a drive through it: what the viewer's core would know, made up.
import { random } from "./random.mjs";

const startUtime = 1_760_000_000_000_000;
export const there = 1, corner = 2, outOfUse = 4, given = 8;

export class World {
  constructor({ landmarks = 200, size = 160, known = false, mapId = 1, seed = 1, offset = 0 } = {}) {
    const r = (this.random = random(seed));
    this.size = size;
    this.offset = offset;
    this.n = landmarks;
    for (const name of ["x", "y", "cxx", "cxy", "cyy", "radius", "probability"]) this[name] = new Float32Array(landmarks);
    this.seen = new Uint32Array(landmarks);
    this.flags = new Uint8Array(landmarks);
    this.idHigh = new Uint32Array(landmarks).fill(mapId * 65536);
    this.idLow = Uint32Array.from({ length: landmarks }, (_, i) => i + 1);
    for (let i = 0; i < landmarks; i++) this.plant(i, known, r);
    this.path = { x: [], y: [], theta: [], sigma: [], status: [], utime: [] };
    this.keyframes = { x: [], y: [], utime: [] };
    this.truth = { x: [], y: [] };
    this.step = 0;
    this.utime = startUtime;
    this.matched = [];
    this.expected = [];
    this.changed = new Set(); // since the latest take
  }

  plant(i, known, r) {
    const s = this.size;
    this.x[i] = (r.uniform() - 0.5) * s;
    this.y[i] = (r.uniform() - 0.5) * s;
    this.radius[i] = r.uniform() < 0.1 ? 0 : 0.08 + 0.3 * r.uniform() ** 2;
    const a = 0.05 + 0.3 * r.uniform(), b = 0.04 + 0.12 * r.uniform(), t = Math.PI * r.uniform(), c = Math.cos(t), sn = Math.sin(t);
    this.cxx[i] = c * c * a * a + sn * sn * b * b;
    this.cyy[i] = sn * sn * a * a + c * c * b * b;
    this.cxy[i] = c * sn * (a * a - b * b);
    const isCorner = r.uniform() < 0.12;
    this.probability[i] = r.uniform() < 0.08 ? NaN : 1 - 0.9 * r.uniform() ** 4;
    const isOut = this.probability[i] < 0.3;
    this.seen[i] = 1 + Math.floor(40 * r.uniform());
    this.flags[i] = known ? there | (isCorner ? corner : 0) | (isOut ? outOfUse : 0) : isCorner ? corner : 0;
  }

  /** A closed road of gentle bends that fills most of the forest. */
  place(k) {
    const a = k * 0.0028 * (160 / this.size), r = 0.31 * this.size * (1 + 0.25 * Math.sin(3 * a) + 0.08 * Math.sin(7.3 * a));
    return { x: r * Math.cos(a), y: 0.86 * r * Math.sin(a) };
  }

  advance(status = 5) {
    const k = this.step++, p = this.place(k), q = this.place(k + 1), theta = Math.atan2(q.y - p.y, q.x - p.x), r = this.random;
    this.utime += 100_000;
    const isBlind = status !== 5 ? true : k % 700 > 560 && k % 700 < 640;
    this.drift = isBlind ? (this.drift ?? 0.1) + (status === 7 ? 0.03 : 0.012) : 0.1 + ((this.drift ?? 0.1) - 0.1) * 0.8;
    const e = this.drift * 0.6, side = Math.sin(k * 0.013 + this.offset * 10);
    this.pose = { x: p.x + e * side * 0.4 + this.offset, y: p.y + e * Math.cos(k * 0.011) * 0.4, theta: theta + 0.01 * side };
    this.status = status === 5 && isBlind ? 6 : status;
    this.sigma = this.drift * 0.5;
    this.truePose = { x: p.x, y: p.y, theta };
    const { x, y, theta: t, sigma, status: st, utime } = this.path;
    x.push(this.pose.x); y.push(this.pose.y); t.push(this.pose.theta); sigma.push(this.sigma); st.push(this.status); utime.push(this.utime);
    this.truth.x.push(p.x);
    this.truth.y.push(p.y);
    if (k % 10 === 0) this.keyframe(isBlind, r);
  }

  keyframe(isBlind, r) {
    const { x, y } = this.pose;
    this.keyframes.x.push(x); this.keyframes.y.push(y); this.keyframes.utime.push(this.utime);
    this.matched = [];
    this.expected = [];
    this.keyframePose = { ...this.pose };
    for (let i = 0; i < Math.min(this.n, 3000); i++) {
      if (Math.hypot(this.x[i] - x, this.y[i] - y) > 26) continue;
      if (isBlind || r.uniform() < 0.12) { if (this.flags[i] & there) this.expected.push(i); continue; }
      if (!(this.flags[i] & there)) this.probability[i] = 0.5;
      this.flags[i] |= there;
      this.seen[i]++;
      if (!Number.isNaN(this.probability[i])) this.probability[i] = Math.min(0.999, this.probability[i] + 0.08 * (1 - this.probability[i]));
      this.cxx[i] = 0.001 + this.cxx[i] * 0.97; this.cyy[i] = 0.001 + this.cyy[i] * 0.97; this.cxy[i] *= 0.97;
      this.matched.push(i);
      this.changed.add(i);
    }
  }

  scan() {
    const c = Math.cos(this.pose.theta), s = Math.sin(this.pose.theta), x = [], y = [], z = [], d = { x: [], y: [], radius: [], kind: [] };
    for (const i of this.matched) {
      const dx = this.x[i] - this.pose.x, dy = this.y[i] - this.pose.y, lx = c * dx + s * dy, ly = -s * dx + c * dy, far = Math.hypot(lx, ly);
      d.x.push(lx); d.y.push(ly); d.radius.push(this.radius[i]); d.kind.push(this.flags[i] & corner ? 1 : 0);
      const toward = Math.atan2(-ly, -lx), n = Math.max(4, Math.min(40, Math.round(300 * (this.radius[i] || 0.2) / far)));
      for (let k = 0; k < n; k++) {
        const a = toward + (k / (n - 1) - 0.5) * 2.6, rr = (this.radius[i] || 0.2) + 0.02 * this.random.normal();
        x.push(lx + rr * Math.cos(a)); y.push(ly + rr * Math.sin(a)); z.push(1.3);
      }
    }
    return { x, y, z, d };
  }

  get count() { let n = 0; for (const f of this.flags) if (f & there) n++; return n; }
  get unused() { let n = 0; for (const f of this.flags) if ((f & there) && (f & outOfUse)) n++; return n; }
}
