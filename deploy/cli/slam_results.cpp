#include "deploy/cli/slam_results.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "common/factor_graph/files/g2o_writer.hpp"
#include "common/wire/convert.hpp"
#include "deploy/cli/truth_track.hpp"
#include "understory/ground_truth_t.hpp"

namespace understory::cli {
namespace {

constexpr int kDigits = 9;  ///< Digits of a number in graph.g2o: a micrometre in a kilometre.

void add_edge(factor_graph::files::G2oWriter& out, const model::Keyframe& keyframe,
              std::size_t index, std::uint64_t landmark_vertex) {
  const auto& landmark = keyframe.landmarks.at(index);
  const geometry::SE2 base_T_centre = keyframe.centre_T_base().inverse();
  const Eigen::Vector2d in_base = base_T_centre * landmark.position_m;

  // d(in_base)/d(xi) for a right perturbation of centre_T_base.
  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian << -1.0, 0.0, in_base.y(), 0.0, -1.0, -in_base.x();
  const Eigen::Matrix2d rotation = base_T_centre.rotation();
  const Eigen::Matrix2d covariance =
      rotation * landmark.covariance_m2 * rotation.transpose() +
      jacobian * keyframe.members.front().covariance * jacobian.transpose();
  const double determinant = covariance.determinant();
  if (!(determinant > 0.0)) return;

  const Eigen::Matrix2d information = covariance.inverse();
  const std::array<std::uint64_t, 2> vertices{keyframe.sequence, landmark_vertex};
  out.edge(factor_graph::graph::FactorKind::kPoint2, vertices, {in_base.data(), 2}, information);
}

/// A message of either channel of the existence tracker.
template <class Message>
void keep(const io::LogEvent& event, ExistenceById& existence) {
  const auto told = wire::decode_message<Message>(event.data);
  if (!told) return;
  for (const model::LandmarkExistence& one : told->landmarks) existence[one.id] = one;
}

/// A message that changes the map.
template <class Message>
void take(const io::LogEvent& event, model::HeldMap& map) {
  if (const auto message = wire::decode_message<Message>(event.data)) map.take(*message);
}

}  // namespace

void SlamResults::add(const io::LogEvent& event) {
  if (event.channel == "SLAM_POSE") {
    const auto pose = wire::decode_message<model::SlamPose>(event.data);
    if (pose && pose->is_localised()) poses.push_back(*pose);
  } else if (event.channel == "MAP") {
    take<model::WholeMap>(event, map);
  } else if (event.channel == "MAP_DELTA") {
    take<model::MapDelta>(event, map);
  } else if (event.channel == "SUBMAP") {
    take<model::Submap>(event, map);
  } else if (event.channel == "MAP_CORRECTION") {
    take<model::MapCorrection>(event, map);
  } else if (event.channel == "KEYFRAME") {
    const auto keyframe = wire::decode_message<model::Keyframe>(event.data);
    if (keyframe) keyframes.insert_or_assign(keyframe->sequence, *keyframe);
  } else if (event.channel == "SLAM_UPDATE") {
    const auto update = wire::decode_message<model::MapUpdate>(event.data);
    if (update) map.take(*update);
    const bool fused = update && (update->status == model::MapUpdateStatus::kFirstMap ||
                                  update->status == model::MapUpdateStatus::kUpdated);
    if (fused) updates.push_back(*update);
  } else if (event.channel == "EXISTENCE") {
    keep<model::Existence>(event, existence);
  } else if (event.channel == "EXISTENCE_STATE") {
    keep<model::ExistenceState>(event, existence);
  } else if (event.channel == "GROUND_TRUTH") {
    const auto one = wire::decode_message<ground_truth_t>(event.data);
    if (one) truth.emplace_back(one->utime, wire::from_wire(one->world_T_vehicle));
  }
}

std::string to_tum(const std::vector<std::pair<model::Utime, geometry::SE2>>& poses) {
  std::string out;
  for (const auto& [utime, pose] : poses) {
    fmt::format_to(std::back_inserter(out), "{:.6f} {:.9g} {:.9g} 0 0 0 {:.9g} {:.9g}\n",
                   1e-6 * static_cast<double>(utime), pose.x(), pose.y(),
                   std::sin(0.5 * pose.theta()), std::cos(0.5 * pose.theta()));
  }
  return out;
}

std::string to_kitti(const std::vector<std::pair<model::Utime, geometry::SE2>>& poses) {
  std::string out;
  for (const auto& [utime, pose] : poses) {
    const double cosine = std::cos(pose.theta());
    const double sine = std::sin(pose.theta());
    fmt::format_to(std::back_inserter(out),
                   "{:.12g} {:.12g} 0 {:.9g} {:.12g} {:.12g} 0 {:.9g} 0 0 1 0\n", cosine, -sine,
                   pose.x(), sine, cosine, pose.y());
  }
  return out;
}

PairedTrajectories paired_trajectories(const SlamResults& results) {
  PairedTrajectories paired{live_trajectory(results), {}};
  if (results.truth.empty()) return paired;
  TruthTrack track;
  for (const auto& [utime, pose] : results.truth) track.add(utime, pose);

  for (const auto& one : std::exchange(paired.live, {})) {
    const auto there = track.at(one.first);
    if (!there) continue;
    paired.live.push_back(one);
    paired.truth.emplace_back(one.first, *there);
  }
  return paired;
}

std::vector<std::pair<model::Utime, geometry::SE2>> live_trajectory(const SlamResults& results) {
  std::vector<std::pair<model::Utime, geometry::SE2>> trajectory;
  for (const auto& pose : results.poses) trajectory.emplace_back(pose.utime, pose.map_T_vehicle());
  return trajectory;
}

std::vector<std::pair<model::Utime, geometry::SE2>> keyframe_trajectory(
    const model::WholeMap& map) {
  std::vector<std::pair<model::Utime, geometry::SE2>> trajectory;
  for (const auto& pose : map.keyframes) trajectory.emplace_back(pose.utime, pose.map_T_vehicle);
  return trajectory;
}

std::string landmarks_csv(const model::WholeMap& map, const ExistenceById& existence) {
  std::string out =
      "id,x_m,y_m,cov_xx_m2,cov_xy_m2,cov_yy_m2,radius_m,times_seen,existence,in_use\n";
  for (const auto& one : map.landmarks) {
    fmt::format_to(std::back_inserter(out), "{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{},",
                   one.id, one.position_m.x(), one.position_m.y(), one.covariance_m2(0, 0),
                   one.covariance_m2(0, 1), one.covariance_m2(1, 1), one.radius_m,
                   one.observation_count);
    const auto told = existence.find(one.id);
    if (told == existence.end()) {
      out += ",\n";
    } else {
      fmt::format_to(std::back_inserter(out), "{:.6g},{}\n", told->second.probability,
                     told->second.is_in_use ? 1 : 0);
    }
  }
  return out;
}

std::string keyframes_csv(const model::WholeMap& map) {
  std::string out = "keyframe,utime_us,x_m,y_m,theta_rad\n";
  for (const auto& one : map.keyframes) {
    fmt::format_to(std::back_inserter(out), "{},{},{:.9g},{:.9g},{:.9g}\n", one.keyframe_sequence,
                   one.utime, one.map_T_vehicle.x(), one.map_T_vehicle.y(),
                   one.map_T_vehicle.theta());
  }
  return out;
}

std::string to_g2o(const SlamResults& results) {
  using factor_graph::graph::VariableType;
  factor_graph::files::G2oWriter out(kDigits);
  const std::optional<model::WholeMap> whole = results.map.whole();
  if (!whole) return out.take();
  const model::WholeMap& map = *whole;

  std::uint64_t next = 0;
  for (const auto& one : map.keyframes) {
    const geometry::SE2& pose = one.map_T_vehicle;
    const std::array<double, 3> value{pose.x(), pose.y(), pose.theta()};
    out.vertex(VariableType::kPose2, one.keyframe_sequence, value);
    next = std::max(next, one.keyframe_sequence + 1);
  }

  if (!map.keyframes.empty()) out.fix(map.keyframes.front().keyframe_sequence);

  std::map<model::LandmarkId, std::uint64_t> vertices;
  for (const auto& one : map.landmarks) {
    vertices[one.id] = next;
    out.vertex(VariableType::kPoint2, next++, {one.position_m.data(), 2});
  }

  for (const auto& update : results.updates) {
    const auto keyframe = results.keyframes.find(update.keyframe_sequence);
    if (keyframe == results.keyframes.end()) continue;
    for (const auto& association : update.associations) {
      const auto vertex = vertices.find(association.landmark_id);
      if (vertex == vertices.end()) continue;
      if (association.keyframe_landmark >= keyframe->second.landmarks.size()) continue;
      add_edge(out, keyframe->second, association.keyframe_landmark, vertex->second);
    }
  }

  return out.take();
}

}  // namespace understory::cli
