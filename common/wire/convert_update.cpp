#include <tuple>

#include "common/wire/convert.hpp"
#include "common/wire/convert_ids.hpp"
#include "common/wire/convert_shared.hpp"

namespace understory::wire {
namespace {

template <class Wire>
std::vector<model::Association> associations(const Wire& wire, Checks& checks) {
  std::vector<model::Association> result;
  result.reserve(wire.associations.size());
  for (std::size_t i = 0; i < wire.associations.size(); ++i) {
    checks.in("associations", i);
    const association_t& one = wire.associations[i];
    checks.range("keyframe_landmark", one.keyframe_landmark, 0, 1e9);
    result.push_back(
        {static_cast<std::uint32_t>(one.keyframe_landmark), landmark_id(one.landmark_id, checks)});
  }
  return result;
}

template <class Wire>
void copy_diagnostics(const Wire& wire, model::MapUpdate& update, Checks& checks) {
  constexpr double kMost = std::numeric_limits<std::int32_t>::max();
  checks.in_message();
  checks.range("candidates", wire.candidates, 0, kMost);
  checks.range("inliers", wire.inliers, 0, kMost);
  checks.range("degrees_of_freedom", wire.degrees_of_freedom, 0, kMost);
  checks.range("chi2", wire.chi2, 0.0, std::numeric_limits<double>::max());
  update.used_prior = wire.used_prior != 0;
  update.candidates = static_cast<std::uint32_t>(wire.candidates);
  update.inliers = static_cast<std::uint32_t>(wire.inliers);
  update.chi2 = wire.chi2;
  update.degrees_of_freedom = static_cast<std::uint32_t>(wire.degrees_of_freedom);
  update.log10_false_alarm = wire.log10_false_alarm;
  update.reason = wire.reason;
}

/// Common part of all versions.
template <class Wire>
model::MapUpdate map_update(const Wire& wire, Checks& checks) {
  checks.range("keyframe_seq", static_cast<double>(wire.keyframe_seq), 0.0, 9.3e18);
  checks.range("status", wire.status, slam_update3_t::FIRST_MAP, slam_update3_t::REJECTED);
  checks.pose("map_T_vehicle", wire.map_T_vehicle);
  checks.pose("map_T_latest_vehicle", wire.map_T_latest_vehicle);
  model::MapUpdate update;
  update.keyframe_sequence = static_cast<std::uint64_t>(wire.keyframe_seq);
  update.utime = wire.utime;
  update.status = static_cast<model::MapUpdateStatus>(wire.status);
  update.map_T_vehicle = from_wire(wire.map_T_vehicle);
  update.covariance = checks.covariance("covariance", wire.covariance);
  update.map_T_latest_vehicle = from_wire(wire.map_T_latest_vehicle);
  update.associations = associations(wire, checks);
  update.added = ids("added", wire.added, checks);
  update.removed = ids("removed", wire.removed, checks);
  update.merged = merges(wire.merged, checks);
  copy_diagnostics(wire, update, checks);
  return update;
}

template <class Wire>
std::vector<model::ScanReference> scans(const Wire& wire, Checks& checks) {
  std::vector<model::ScanReference> result;
  result.reserve(wire.scans.size());
  for (std::size_t i = 0; i < wire.scans.size(); ++i) {
    checks.in("scans", i);
    checks.range("utime", static_cast<double>(wire.scans[i].utime), 0.0, 9.1e15);
    checks.range("seq", static_cast<double>(wire.scans[i].seq), 0.0, 9.3e18);
    result.push_back({wire.scans[i].utime, static_cast<std::uint64_t>(wire.scans[i].seq)});
  }
  return result;
}

/// Each detection must have one landmark or none.
template <class Wire>
std::vector<model::IdentifiedDetection> identified(const Wire& wire, Checks& checks) {
  std::vector<model::IdentifiedDetection> result;
  result.reserve(wire.detections.size());
  for (std::size_t i = 0; i < wire.detections.size(); ++i) {
    const identified_detection_t& one = wire.detections[i];
    checks.in("detections", i);
    checks.range("scan", one.scan, 0.0, static_cast<double>(wire.scans.size()) - 1.0);
    checks.range("detection", one.detection, 0.0, kMostDetections);
    if (i > 0) {
      const identified_detection_t& last = wire.detections[i - 1];
      checks.consistent(std::tie(last.scan, last.detection) < std::tie(one.scan, one.detection),
                        "in order of scan and detection");
    }
    result.push_back({static_cast<std::uint32_t>(one.scan),
                      static_cast<std::uint32_t>(one.detection),
                      static_cast<model::LandmarkId>(one.landmark_id)});
  }
  return result;
}

void copy_seen(const model::MapUpdate& update, slam_update3_t& wire) {
  wire.num_scans = static_cast<std::int32_t>(update.scans.size());
  for (const model::ScanReference& one : update.scans) {
    scan_reference_t& out = wire.scans.emplace_back();
    out.utime = one.utime;
    out.seq = static_cast<std::int64_t>(one.sequence);
  }

  wire.num_detections = static_cast<std::int32_t>(update.detections.size());
  for (const model::IdentifiedDetection& one : update.detections) {
    identified_detection_t& out = wire.detections.emplace_back();
    out.scan = static_cast<std::int32_t>(one.scan);
    out.detection = static_cast<std::int32_t>(one.detection);
    out.landmark_id = static_cast<std::int64_t>(one.landmark_id);
  }
  wire.num_expected = static_cast<std::int32_t>(update.expected.size());
  for (const model::ExpectedLandmark& one : update.expected) {
    expected_landmark_t& out = wire.expected.emplace_back();
    out.landmark_id = static_cast<std::int64_t>(one.id);
    out.sight = static_cast<std::int8_t>(one.sight);
  }
}

std::vector<model::ExpectedLandmark> expected(const slam_update3_t& wire, Checks& checks) {
  std::vector<model::ExpectedLandmark> result;
  result.reserve(wire.expected.size());
  for (std::size_t i = 0; i < wire.expected.size(); ++i) {
    const expected_landmark_t& one = wire.expected[i];
    checks.in("expected", i);
    checks.range("sight", one.sight, expected_landmark_t::UNKNOWN, expected_landmark_t::CLEAR);
    result.push_back(
        {landmark_id(one.landmark_id, checks), static_cast<model::LineOfSight>(one.sight)});
    checks.consistent(i == 0 || result[i - 1].id < result[i].id, "in order of landmark_id");
  }
  return result;
}

std::vector<model::ExpectedLandmark> expected(const slam_update2_t& wire, Checks& checks) {
  std::vector<model::ExpectedLandmark> result;
  for (const model::LandmarkId id : ids("expected", wire.expected, checks)) result.push_back({id});
  return result;
}

/// Common part of the two versions with detections.
template <class Wire>
Result<model::MapUpdate> update_with_detections(const Wire& wire) {
  Checks checks;
  checks.range("map_id", wire.map_id, 1, kMostMaps);
  model::MapUpdate update = map_update(wire, checks);
  update.map_id = static_cast<std::uint32_t>(wire.map_id);
  update.is_provisional = wire.provisional != 0;
  update.is_lost = wire.lost != 0;
  update.scans = scans(wire, checks);
  update.detections = identified(wire, checks);
  update.expected = expected(wire, checks);
  return checks.result(update);
}

}  // namespace

Result<model::MapUpdate> from_wire(const slam_update3_t& wire) {
  return update_with_detections(wire);
}

Result<model::MapUpdate> from_wire(const slam_update2_t& wire) {
  return update_with_detections(wire);
}

Result<model::MapUpdate> from_wire(const slam_update_t& wire) {
  Checks checks;
  model::MapUpdate update = map_update(wire, checks);
  return checks.result(update);
}

slam_update3_t to_wire(const model::MapUpdate& update) {
  slam_update3_t wire{};
  wire.utime = update.utime;
  wire.seq = static_cast<std::int64_t>(update.keyframe_sequence);
  wire.keyframe_seq = wire.seq;
  wire.status = static_cast<std::int8_t>(update.status);
  wire.map_id = static_cast<std::int32_t>(update.map_id);
  wire.provisional = update.is_provisional ? 1 : 0;
  wire.lost = update.is_lost ? 1 : 0;
  wire.map_T_vehicle = to_wire(update.map_T_vehicle);
  copy_matrix(update.covariance, wire.covariance);

  wire.map_T_latest_vehicle = to_wire(update.map_T_latest_vehicle);
  wire.num_associations = static_cast<std::int32_t>(update.associations.size());
  for (const model::Association& one : update.associations) {
    association_t& out = wire.associations.emplace_back();
    out.keyframe_landmark = static_cast<std::int32_t>(one.keyframe_landmark);
    out.landmark_id = static_cast<std::int64_t>(one.landmark_id);
  }

  wire.added.assign(update.added.begin(), update.added.end());
  wire.removed.assign(update.removed.begin(), update.removed.end());
  wire.merged = to_wire(update.merged);
  copy_counts(wire);
  copy_seen(update, wire);
  wire.used_prior = update.used_prior ? 1 : 0;
  wire.candidates = static_cast<std::int32_t>(update.candidates);
  wire.inliers = static_cast<std::int32_t>(update.inliers);
  wire.chi2 = update.chi2;
  wire.degrees_of_freedom = static_cast<std::int32_t>(update.degrees_of_freedom);
  wire.log10_false_alarm = update.log10_false_alarm;
  wire.reason = update.reason;

  return wire;
}

}  // namespace understory::wire
