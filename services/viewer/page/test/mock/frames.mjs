// Parts of frames from a made-up world.
const f32 = (a) => Float32Array.from(a), u32 = (a) => Uint32Array.from(a);
export const statusNames = ["first map", "localised", "not sure", "rolled back", "rejected", "tracked", "coasting", "lost", "new map"];

/** All landmarks (slots = null) or some, by slot. */
export function landmarks(w, slots = null, counts = null) {
  const s = slots ? u32(slots) : Uint32Array.from({ length: w.n }, (_, i) => i), pick = (a) => (slots ? a.constructor.from(s, (i) => a[i]) : a);
  const { used, unused } = counts ?? { used: w.count, unused: w.unused };
  return [{ landmarks: { slots: w.n, used, unused } }, {
    slot: s, id_low: pick(w.idLow), id_high: pick(w.idHigh), x: pick(w.x), y: pick(w.y), cxx: pick(w.cxx), cxy: pick(w.cxy), cyy: pick(w.cyy),
    radius: pick(w.radius), probability: pick(w.probability), seen: pick(w.seen), flags: pick(w.flags),
  }];
}

export function paths(w, first, firstKeyframe) {
  const cut = (a, n) => a.slice(n), p = w.path, k = w.keyframes, t = w.truth;
  return [{ path: { first, total: p.x.length }, keyframes: { first: firstKeyframe, total: k.x.length }, truth_path: { first, total: t.x.length } }, {
    path_x: f32(cut(p.x, first)), path_y: f32(cut(p.y, first)), path_theta: f32(cut(p.theta, first)), path_sigma: f32(cut(p.sigma, first)),
    path_status: Uint8Array.from(cut(p.status, first)), path_utime: Float64Array.from(cut(p.utime, first)),
    keyframe_x: f32(cut(k.x, firstKeyframe)), keyframe_y: f32(cut(k.y, firstKeyframe)), keyframe_utime: Float64Array.from(cut(k.utime, firstKeyframe)),
    truth_x: f32(cut(t.x, first)), truth_y: f32(cut(t.y, first)),
  }];
}

export function pose(w) {
  const a = w.sigma ** 2, b = (0.6 * w.sigma) ** 2, h = (0.004 + 0.04 * w.sigma) ** 2;
  return { pose: { utime: w.utime, map_id: 1, ...w.pose, covariance: [a, 0.2 * b, 0, 0.2 * b, b, 0, 0, 0, h], status: statusNames[w.status], is_sure: w.status !== 7, is_provisional: false,
    submap_id: 2, correction_version: 3 }, truth: w.truePose };
}

export function seen(w) {
  const { x, y, z, d } = w.scan();
  return [{ scan: { utime: w.utime }, matches: { keyframe_seq: w.keyframes.x.length, status: "localised", reason: "", ...w.keyframePose, expected: w.matched.length + w.expected.length } }, {
    scan_x: f32(x), scan_y: f32(y), scan_z: f32(z), detection_x: f32(d.x), detection_y: f32(d.y), detection_radius: f32(d.radius), detection_kind: Uint8Array.from(d.kind),
    match_slot: u32(w.matched), unseen_slot: u32(w.expected),
  }];
}

export function hierarchy(w) {
  const a = [], b = [], level = [], there = [...w.flags.keys()].filter((i) => w.flags[i] & 1).slice(0, 1500);
  for (const i of there) {
    const near = there.filter((j) => j !== i).sort((p, q) => Math.hypot(w.x[p] - w.x[i], w.y[p] - w.y[i]) - Math.hypot(w.x[q] - w.x[i], w.y[q] - w.y[i])).slice(0, 4);
    near.forEach((j, k) => { a.push(i); b.push(j); level.push(k < 2 ? 1 : 0); });
  }
  return [{ hierarchy: { levels: 2 } }, { edge_a: u32(a), edge_b: u32(b), edge_level: Uint8Array.from(level) }];
}

export function overlays(w) {
  const s = w.size / 2 - 4, box = (x0, y0, x1, y1) => [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
  const p = (k) => { const q = w.place(k); return [q.x, q.y]; };
  return { submaps: [
    { id: 1, x: -s / 2, y: 0, theta: 0, outline: box(-s, -s, 0, s) }, { id: 2, x: s / 2, y: 0, theta: 0.4, outline: box(0, -s, s, s) },
  ], closures: [
    { id: 1, source: "loop_closer", status: "accepted", reason: "", from: p(0), to: p(600) }, { id: 2, source: "loop_closer", status: "waiting", reason: "one of three", from: p(300), to: p(900) },
    { id: 3, source: "manual", status: "refused", reason: "chi_square", from: p(150), to: p(1300) },
  ] };
}

const names = ["lidar_imu_input", "landmark_extractor", "associator", "ekf", "keyframer", "geoslam_mapper", "submap_store", "loop_closer", "existence_tracker"];
const outputs = ["LIDAR_SCAN", "LANDMARKS", "TRACKED_LANDMARKS", "EKF_POSE", "KEYFRAME", "SLAM_POSE", "SUBMAP_STORED", "LOOP_CLOSURE", "EXISTENCE"];

export function processes(w, ill = {}) {
  const wave = (i, s) => 1 + 0.12 * Math.sin(w.step * 0.05 + i * s);
  return { processes: names.map((name, i) => {
    const state = ill[name] ?? (name === "loop_closer" ? "degraded" : "ok");
    return { name, state, silent_s: state === "silent" ? 3.2 : 0.3, uptime_s: w.step / 10 + 61, version: "1.0.0", latency_p50_us: 400 * (i + 1) * wave(i, 1), latency_p90_us: 900 * (i + 1), latency_p99_us: 1500 * (i + 1) * wave(i, 2),
      latency_max_us: 3000 * (i + 1), rss_bytes: (20 + 11 * i) * 1e6, cpu_share: 0.02 * (i + 1), handled: w.step * (i + 1), message_utime: w.utime, last_error_code: name === "loop_closer" ? "no_reply" : "",
      last_error: name === "loop_closer" ? "submap 2 did not come within 2 s" : "", reasons: name === "loop_closer" ? [["SUBMAP_REPLY", "no_reply", 4], ["", "too_few_inliers", 12]] : [],
      channels: [{ channel: i ? outputs[i - 1] : "RAW_SWEEP", is_output: false, rate_hz: 10, messages: w.step, lost: i === 2 ? 3 : 0, malformed: 0, dropped: 0, last_utime: w.utime },
        { channel: outputs[i], is_output: true, rate_hz: [10, 10, 10, 10, 1, 10, 0.1, 0.02, 1][i] * wave(i, 3), messages: w.step, lost: 0, malformed: 0, dropped: 0, last_utime: w.utime }] };
  }) };
}

export function numbers(w) {
  const k = w.step, e = Math.hypot(w.pose.x - w.truePose.x, w.pose.y - w.truePose.y), dof = 2 * Math.max(1, w.matched.length);
  const noise = (s) => 0.5 + 0.5 * Math.abs(Math.sin(k * s) + 0.6 * Math.sin(k * s * 2.7 + 1));
  return { numbers: { error_m: e, error_deg: 0.3 * noise(0.03), nees: 3 * noise(0.021), nis: w.matched.length ? dof * (0.75 + 0.25 * noise(0.17)) : null, nis_dof: w.matched.length ? dof : null, rate_hz: 9.9 + 0.2 * noise(0.2),
    latency_ms: 14 + 9 * noise(0.11), missing_share: w.expected.length / Math.max(1, w.matched.length + w.expected.length), new_share: 0.06 * noise(0.04), is_mapping_needed: k % 900 > 700, clients: 1, page_ms: 22 + 8 * noise(0.3), page_p99_ms: 61 } };
}

const texts = [["info", "keyframer", "KEYFRAME", "", "keyframe of 10 observations, 14 landmarks"], ["info", "geoslam_mapper", "SUBMAP", "handed_over", "submap 1 handed over: 204 landmarks"],
  ["warning", "associator", "LANDMARKS", "gap", "3 messages missing"], ["debug", "ekf", "", "gate", "innovation of track 81 outside of the gate"], ["info", "existence_tracker", "EXISTENCE", "", "2 landmarks taken out of use"],
  ["error", "loop_closer", "SUBMAP_REPLY", "no_reply", "submap 2 did not come within 2 s"]];

export function logLine(w, i) {
  const [level, process, channel, code, text] = texts[i % texts.length];
  return { utime: w.utime, process, level, channel, code, text };
}

export function story(w, question) {
  const t = Array.from({ length: 40 }, (_, i) => w.utime - (40 - i) * 4e6);
  if (question.ask === "pose") return { title: `Pose at ${new Date(question.utime / 1000).toISOString().slice(11, 21)}`, facts: [["Status", "tracked"], ["Keyframe", 12], ["Landmarks matched", 14]],
    steps: [["RAW_SWEEP", "2048 columns", 18.4], ["LANDMARKS", "16 trunks, 2 corners", 7.9], ["TRACKED_LANDMARKS", "15 of 18 tracked", 1.1], ["EKF_POSE", "NIS 27.1 of 30", 0.8], ["SLAM_POSE", "by keyframe 12", 0.4]].map(([name, text, ms]) => ({ name, text, ms })) };
  const i = Number(BigInt(question.id) & 0xffffffffn) - 1;
  return { title: `Trunk ${question.id}`, facts: [["Diameter", `${(200 * w.radius[i]).toFixed(0)} cm`], ["Seen", `${w.seen[i]} times`], ["Probability that it exists", Number(w.probability[i].toFixed(3))], ["Standard deviation", "4.2 cm and 2.9 cm"], ["Submap", 2]],
    events: [[t[0], "first seen, 23.1 m away"], [t[8], "merged with 281474976711021"], [t[20], "not seen though expected"], [t[39], "seen from keyframe 12"]],
    series: [{ name: "Probability that it exists", unit: "", t, v: t.map((_, k) => 1 - 0.5 * Math.exp(-k / 9) - (k > 19 && k < 24 ? 0.2 : 0)) }],
    seen_from: Array.from({ length: 9 }, (_, k) => { const a = k * 0.5; return [w.x[i] + (9 + k) * Math.cos(a), w.y[i] + (9 + k) * Math.sin(a)]; }) };
}
