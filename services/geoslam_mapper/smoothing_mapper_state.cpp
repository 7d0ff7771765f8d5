// Saving and loading our mapper.
#include <stdexcept>

#include "common/model/state.hpp"
#include "services/geoslam_mapper/smoothing_mapper.hpp"

namespace understory {
namespace {

constexpr int kStateVersion = 4;

Json to_value(const KeyframeLandmark& l) {
  return {matrix_to_json<2, 1>(l.position_m), matrix_to_json<2, 2>(l.covariance_m2), l.radius_m,
          l.times_seen, static_cast<int>(l.kind)};
}

KeyframeLandmark keyframe_landmark_from(const Json& json) {
  KeyframeLandmark l;
  l.position_m = matrix_from_json<2, 1>(json.at(0));
  l.covariance_m2 = matrix_from_json<2, 2>(json.at(1));
  json.at(2).get_to(l.radius_m);
  json.at(3).get_to(l.times_seen);
  l.kind = static_cast<LandmarkKind>(json.at(4).get<int>());
  return l;
}

Json to_value(const StoredLandmark& l) {
  return {l.id,
          l.point ? Json(index(*l.point)) : Json(nullptr),
          matrix_to_json<2, 1>(l.position_m),
          matrix_to_json<2, 2>(l.prior_covariance),
          l.information,
          l.radius_m,
          l.times_seen,
          l.last_keyframe,
          l.nodes,
          static_cast<int>(l.kind)};
}

StoredLandmark stored_landmark_from(const Json& json) {
  StoredLandmark l;
  json.at(0).get_to(l.id);
  if (!json.at(1).is_null()) l.point = PointId(json.at(1).get<std::uint32_t>());
  l.position_m = matrix_from_json<2, 1>(json.at(2));
  l.prior_covariance = matrix_from_json<2, 2>(json.at(3));
  json.at(4).get_to(l.information);
  json.at(5).get_to(l.radius_m);
  json.at(6).get_to(l.times_seen);
  json.at(7).get_to(l.last_keyframe);
  json.at(8).get_to(l.nodes);
  l.kind = static_cast<LandmarkKind>(json.at(9).get<int>());
  return l;
}

Json to_value(const Candidate& c) {
  Json sightings = Json::array();
  for (const Candidate::Sighting& s : c.sightings)
    sightings.push_back({s.node, to_value(s.landmark)});
  return {matrix_to_json<2, 1>(c.position_m),
          sightings,
          c.times_seen,
          c.times_in_view,
          c.first_keyframe,
          static_cast<int>(c.kind)};
}

Candidate candidate_from(const Json& json) {
  Candidate c;
  c.position_m = matrix_from_json<2, 1>(json.at(0));
  for (const Json& s : json.at(1))
    c.sightings.push_back({s.at(0).get<NodeIndex>(), keyframe_landmark_from(s.at(1))});
  json.at(2).get_to(c.times_seen);
  json.at(3).get_to(c.times_in_view);
  json.at(4).get_to(c.first_keyframe);
  c.kind = static_cast<LandmarkKind>(json.at(5).get<int>());
  return c;
}

Json to_value(const std::optional<GyroTurn>& t) {
  if (!t) return nullptr;
  return {t->turn_rad, t->variance, t->seconds, t->bias_rad};
}

std::optional<GyroTurn> gyro_turn_from(const Json& json) {
  if (json.is_null()) return std::nullopt;
  return GyroTurn{json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>(),
                  json.at(3).get<double>()};
}

Json to_value(const Graph& graph) {
  Json points = Json::array(), pose_priors = Json::array(), relative = Json::array(),
       point_priors = Json::array(), seen = Json::array();
  for (const Eigen::Vector2d& p : graph.points) points.push_back({p.x(), p.y()});
  for (const PosePrior& f : graph.pose_priors)
    pose_priors.push_back({index(f.pose), f.mean, matrix_to_json<3, 3>(f.information)});
  for (const RelativePose& f : graph.relative_poses) {
    relative.push_back({index(f.a), index(f.b), f.a_T_b, matrix_to_json<3, 3>(f.information)});
  }
  for (const PointPrior& f : graph.point_priors) {
    point_priors.push_back(
        {index(f.point), matrix_to_json<2, 1>(f.mean), matrix_to_json<2, 2>(f.information)});
  }
  for (const PointObservation& f : graph.observations) {
    seen.push_back({index(f.pose), index(f.point), matrix_to_json<2, 1>(f.position),
                    matrix_to_json<2, 2>(f.information)});
  }
  Json turning = Json::array(), scalar_priors = Json::array(), steps = Json::array();
  for (const TurningPose& f : graph.turning_poses) {
    turning.push_back({index(f.motion.a), index(f.motion.b), f.motion.a_T_b,
                       matrix_to_json<3, 3>(f.motion.information), index(f.bias), f.seconds});
  }
  for (const ScalarPrior& f : graph.scalar_priors)
    scalar_priors.push_back({index(f.scalar), f.mean, f.information});
  for (const ScalarStep& f : graph.scalar_steps)
    steps.push_back({index(f.a), index(f.b), f.information});
  return {{"scalars", graph.scalars},     {"turning", turning},
          {"scalar_steps", steps},        {"scalar_priors", scalar_priors},
          {"poses", graph.poses},         {"points", points},
          {"pose_priors", pose_priors},   {"relative", relative},
          {"point_priors", point_priors}, {"observations", seen}};
}

PoseId pose_id(const Json& json) { return PoseId(json.get<std::uint32_t>()); }
PointId point_id(const Json& json) { return PointId(json.get<std::uint32_t>()); }
ScalarId scalar_id(const Json& json) { return ScalarId(json.get<std::uint32_t>()); }

Graph graph_from(const Json& json) {
  Graph graph;
  json.at("poses").get_to(graph.poses);
  for (const Json& p : json.at("points"))
    graph.points.emplace_back(p.at(0).get<double>(), p.at(1).get<double>());
  for (const Json& f : json.at("pose_priors")) {
    graph.pose_priors.push_back(
        {pose_id(f.at(0)), f.at(1).get<SE2>(), matrix_from_json<3, 3>(f.at(2))});
  }
  for (const Json& f : json.at("relative")) {
    graph.relative_poses.push_back(
        {pose_id(f.at(0)), pose_id(f.at(1)), f.at(2).get<SE2>(), matrix_from_json<3, 3>(f.at(3))});
  }
  for (const Json& f : json.at("point_priors")) {
    graph.point_priors.push_back(
        {point_id(f.at(0)), matrix_from_json<2, 1>(f.at(1)), matrix_from_json<2, 2>(f.at(2))});
  }
  for (const Json& f : json.at("observations")) {
    graph.observations.push_back({pose_id(f.at(0)), point_id(f.at(1)),
                                  matrix_from_json<2, 1>(f.at(2)),
                                  matrix_from_json<2, 2>(f.at(3))});
  }
  json.at("scalars").get_to(graph.scalars);
  for (const Json& f : json.at("turning")) {
    const RelativePose motion{pose_id(f.at(0)), pose_id(f.at(1)), f.at(2).get<SE2>(),
                              matrix_from_json<3, 3>(f.at(3))};
    graph.turning_poses.push_back({motion, scalar_id(f.at(4)), f.at(5).get<double>()});
  }
  for (const Json& f : json.at("scalar_priors")) {
    graph.scalar_priors.push_back(
        {scalar_id(f.at(0)), f.at(1).get<double>(), f.at(2).get<double>()});
  }
  for (const Json& f : json.at("scalar_steps")) {
    graph.scalar_steps.push_back({scalar_id(f.at(0)), scalar_id(f.at(1)), f.at(2).get<double>()});
  }
  return graph;
}

}  // namespace

std::string SmoothingMapper::save() const {
  Json landmarks = Json::array(), candidates = Json::array(), nodes = Json::array(),
       bases = Json::array();
  for (const auto& [id, landmark] : store_.all()) landmarks.push_back(to_value(landmark));
  for (const Candidate& candidate : candidates_) candidates.push_back(to_value(candidate));
  for (const Node& node : nodes_) {
    Json seen = Json::array();
    for (const auto& [id, factor] : node.observations) seen.push_back({id, index(factor)});
    nodes.push_back({index(node.centre), seen, node.stands});
  }
  for (const Base& base : bases_)
    bases.push_back({base.node, base.sequence, base.utime, base.centre_T_base, base.is_origin,
                     base.centre_T_middle});
  Json last_member = nullptr;
  if (last_member_)
    last_member = {last_member_->node, last_member_->utime, last_member_->centre_T_vehicle,
                   to_value(last_member_->turn)};
  Json located = nullptr;
  if (located_) {
    located = {located_->utime, located_->map_T_vehicle, located_->step,
               matrix_to_json<3, 3>(located_->covariance)};
  }
  return to_state({{"version", kStateVersion},
                   {"graph", to_value(smoother_.graph())},
                   {"landmarks", landmarks},
                   {"next_id", store_.next_id()},
                   {"candidates", candidates},
                   {"nodes", nodes},
                   {"bases", bases},
                   {"odometry", odometry_},
                   {"gyro", gyro_.save()},
                   {"map_was_given", map_was_given_},
                   {"keyframes", keyframes_},
                   {"last_member", last_member},
                   {"last_base", optional_to_json(map_T_last_base_)},
                   {"last_utime", optional_to_json(last_utime_)},
                   {"first_offered", optional_to_json(first_offered_)},
                   {"start_covariance", matrix_to_json<2, 2>(start_covariance_m2_)},
                   {"located", located}});
}

void SmoothingMapper::load(const std::string& state) {
  const Json json = from_state(state);
  if (json.at("version").get<int>() != kStateVersion)
    throw std::invalid_argument("mapper: state of another version");
  SmoothingMapper loaded(parameters_);
  const Graph graph = graph_from(json.at("graph"));
  loaded.smoother_.start_from(graph);
  loaded.landmark_of_point_.assign(graph.points.size(), 0);
  for (const Json& landmark : json.at("landmarks")) {
    const StoredLandmark one = stored_landmark_from(landmark);
    loaded.store_.restore(one);
    if (one.point) loaded.landmark_of_point_.at(index(*one.point)) = one.id;
  }
  loaded.store_.set_next_id(json.at("next_id").get<LandmarkId>());
  for (const Json& candidate : json.at("candidates"))
    loaded.candidates_.push_back(candidate_from(candidate));
  for (const Json& node : json.at("nodes")) {
    Node out{pose_id(node.at(0)), {}, node.at(2).get<bool>()};
    for (const Json& seen : node.at(1))
      out.observations[seen.at(0).get<LandmarkId>()] =
          ObservationId(seen.at(1).get<std::uint32_t>());
    loaded.nodes_.push_back(std::move(out));
  }
  for (const Json& base : json.at("bases")) {
    loaded.add_base({base.at(0).get<NodeIndex>(), base.at(1).get<std::uint64_t>(),
                     base.at(2).get<Utime>(), base.at(3).get<SE2WithCovariance>(),
                     base.at(5).get<SE2>(), base.at(4).get<bool>()});
  }
  json.at("odometry").get_to(loaded.odometry_);
  loaded.gyro_.load(json.at("gyro"));
  json.at("map_was_given").get_to(loaded.map_was_given_);
  json.at("keyframes").get_to(loaded.keyframes_);
  const Json& last = json.at("last_member");
  if (!last.is_null()) {
    loaded.last_member_ =
        LastMember{last.at(0).get<NodeIndex>(), last.at(1).get<Utime>(),
                   last.at(2).get<SE2WithCovariance>(), gyro_turn_from(last.at(3))};
  }
  loaded.map_T_last_base_ = optional_from_json<SE2WithCovariance>(json.at("last_base"));
  loaded.last_utime_ = optional_from_json<Utime>(json.at("last_utime"));
  loaded.first_offered_ = optional_from_json<Utime>(json.at("first_offered"));
  loaded.start_covariance_m2_ = matrix_from_json<2, 2>(json.at("start_covariance"));
  const Json& located = json.at("located");
  if (!located.is_null()) {
    loaded.located_ = LocatedScan{located.at(0).get<Utime>(), located.at(1).get<SE2>(),
                                  located.at(2).get<SE2>(), matrix_from_json<3, 3>(located.at(3))};
  }
  if (!loaded.nodes_.empty()) loaded.smoother_.update();
  for (const auto& [id, landmark] : loaded.store_.all()) loaded.changed_.push_back(id);
  *this = std::move(loaded);
}

}  // namespace understory
