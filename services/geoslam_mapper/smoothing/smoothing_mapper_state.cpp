// Saving and loading our mapper.
#include <stdexcept>

#include "common/model/state.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

constexpr int kStateVersion = 4;

model::Json to_value(const model::KeyframeLandmark& l) {
  return {model::matrix_to_json<2, 1>(l.position_m), model::matrix_to_json<2, 2>(l.covariance_m2),
          l.radius_m, l.observation_count, static_cast<int>(l.kind)};
}

model::KeyframeLandmark keyframe_landmark_from(const model::Json& json) {
  model::KeyframeLandmark l;
  l.position_m = model::matrix_from_json<2, 1>(json.at(0));
  l.covariance_m2 = model::matrix_from_json<2, 2>(json.at(1));
  json.at(2).get_to(l.radius_m);
  json.at(3).get_to(l.observation_count);
  l.kind = static_cast<model::LandmarkKind>(json.at(4).get<int>());
  return l;
}

model::Json to_value(const StoredLandmark& l) {
  return {l.id,
          l.point ? model::Json(index(*l.point)) : model::Json(nullptr),
          model::matrix_to_json<2, 1>(l.position_m),
          model::matrix_to_json<2, 2>(l.prior_covariance),
          l.information,
          l.radius_m,
          l.observation_count,
          l.last_keyframe,
          l.nodes,
          static_cast<int>(l.kind)};
}

StoredLandmark stored_landmark_from(const model::Json& json) {
  StoredLandmark l;
  json.at(0).get_to(l.id);
  if (!json.at(1).is_null())
    l.point = factor_graph::plane::PointId(json.at(1).get<std::uint32_t>());
  l.position_m = model::matrix_from_json<2, 1>(json.at(2));
  l.prior_covariance = model::matrix_from_json<2, 2>(json.at(3));
  json.at(4).get_to(l.information);
  json.at(5).get_to(l.radius_m);
  json.at(6).get_to(l.observation_count);
  json.at(7).get_to(l.last_keyframe);
  json.at(8).get_to(l.nodes);
  l.kind = static_cast<model::LandmarkKind>(json.at(9).get<int>());
  return l;
}

model::Json to_value(const Candidate& c) {
  model::Json observations = model::Json::array();
  for (const Candidate::Observation& s : c.observations)
    observations.push_back({s.node, to_value(s.landmark)});
  return {model::matrix_to_json<2, 1>(c.position_m),
          observations,
          c.observation_count,
          c.times_in_view,
          c.first_keyframe,
          static_cast<int>(c.kind)};
}

Candidate candidate_from(const model::Json& json) {
  Candidate c;
  c.position_m = model::matrix_from_json<2, 1>(json.at(0));
  for (const model::Json& s : json.at(1))
    c.observations.push_back({s.at(0).get<NodeIndex>(), keyframe_landmark_from(s.at(1))});
  json.at(2).get_to(c.observation_count);
  json.at(3).get_to(c.times_in_view);
  json.at(4).get_to(c.first_keyframe);
  c.kind = static_cast<model::LandmarkKind>(json.at(5).get<int>());
  return c;
}

model::Json to_value(const std::optional<model::GyroRotation>& t) {
  if (!t) return nullptr;
  return {t->rotation_rad, t->variance, t->seconds, t->bias_rad};
}

std::optional<model::GyroRotation> gyro_rotation_from(const model::Json& json) {
  if (json.is_null()) return std::nullopt;
  return model::GyroRotation{json.at(0).get<double>(), json.at(1).get<double>(),
                             json.at(2).get<double>(), json.at(3).get<double>()};
}

model::Json to_value(const factor_graph::plane::Graph& graph) {
  model::Json points = model::Json::array(), pose_priors = model::Json::array(),
              relative = model::Json::array(), point_priors = model::Json::array(),
              seen = model::Json::array();
  for (const Eigen::Vector2d& p : graph.points) points.push_back({p.x(), p.y()});
  for (const factor_graph::plane::PosePrior& f : graph.pose_priors)
    pose_priors.push_back({index(f.pose), f.mean, model::matrix_to_json<3, 3>(f.information)});
  for (const factor_graph::plane::RelativePose& f : graph.relative_poses) {
    relative.push_back(
        {index(f.a), index(f.b), f.a_T_b, model::matrix_to_json<3, 3>(f.information)});
  }
  for (const factor_graph::plane::PointPrior& f : graph.point_priors) {
    point_priors.push_back({index(f.point), model::matrix_to_json<2, 1>(f.mean),
                            model::matrix_to_json<2, 2>(f.information)});
  }
  for (const factor_graph::plane::PointObservation& f : graph.observations) {
    seen.push_back({index(f.pose), index(f.point), model::matrix_to_json<2, 1>(f.position),
                    model::matrix_to_json<2, 2>(f.information)});
  }
  model::Json turning = model::Json::array(), scalar_priors = model::Json::array(),
              steps = model::Json::array();
  for (const factor_graph::plane::BiasedRelativePose& f : graph.biased_relative_poses) {
    turning.push_back({index(f.motion.a), index(f.motion.b), f.motion.a_T_b,
                       model::matrix_to_json<3, 3>(f.motion.information), index(f.bias),
                       f.seconds});
  }
  for (const factor_graph::plane::ScalarPrior& f : graph.scalar_priors)
    scalar_priors.push_back({index(f.scalar), f.mean, f.information});
  for (const factor_graph::plane::ScalarStep& f : graph.scalar_steps)
    steps.push_back({index(f.a), index(f.b), f.information});
  return {{"scalars", graph.scalars},     {"turning", turning},
          {"scalar_steps", steps},        {"scalar_priors", scalar_priors},
          {"poses", graph.poses},         {"points", points},
          {"pose_priors", pose_priors},   {"relative", relative},
          {"point_priors", point_priors}, {"observations", seen}};
}

factor_graph::plane::PoseId pose_id(const model::Json& json) {
  return factor_graph::plane::PoseId(json.get<std::uint32_t>());
}
factor_graph::plane::PointId point_id(const model::Json& json) {
  return factor_graph::plane::PointId(json.get<std::uint32_t>());
}
factor_graph::plane::ScalarId scalar_id(const model::Json& json) {
  return factor_graph::plane::ScalarId(json.get<std::uint32_t>());
}

factor_graph::plane::Graph graph_from(const model::Json& json) {
  factor_graph::plane::Graph graph;
  json.at("poses").get_to(graph.poses);
  for (const model::Json& p : json.at("points"))
    graph.points.emplace_back(p.at(0).get<double>(), p.at(1).get<double>());
  for (const model::Json& f : json.at("pose_priors")) {
    graph.pose_priors.push_back(
        {pose_id(f.at(0)), f.at(1).get<geometry::SE2>(), model::matrix_from_json<3, 3>(f.at(2))});
  }
  for (const model::Json& f : json.at("relative")) {
    graph.relative_poses.push_back({pose_id(f.at(0)), pose_id(f.at(1)),
                                    f.at(2).get<geometry::SE2>(),
                                    model::matrix_from_json<3, 3>(f.at(3))});
  }
  for (const model::Json& f : json.at("point_priors")) {
    graph.point_priors.push_back({point_id(f.at(0)), model::matrix_from_json<2, 1>(f.at(1)),
                                  model::matrix_from_json<2, 2>(f.at(2))});
  }
  for (const model::Json& f : json.at("observations")) {
    graph.observations.push_back({pose_id(f.at(0)), point_id(f.at(1)),
                                  model::matrix_from_json<2, 1>(f.at(2)),
                                  model::matrix_from_json<2, 2>(f.at(3))});
  }
  json.at("scalars").get_to(graph.scalars);
  for (const model::Json& f : json.at("turning")) {
    const factor_graph::plane::RelativePose motion{pose_id(f.at(0)), pose_id(f.at(1)),
                                                   f.at(2).get<geometry::SE2>(),
                                                   model::matrix_from_json<3, 3>(f.at(3))};
    graph.biased_relative_poses.push_back({motion, scalar_id(f.at(4)), f.at(5).get<double>()});
  }
  for (const model::Json& f : json.at("scalar_priors")) {
    graph.scalar_priors.push_back(
        {scalar_id(f.at(0)), f.at(1).get<double>(), f.at(2).get<double>()});
  }
  for (const model::Json& f : json.at("scalar_steps")) {
    graph.scalar_steps.push_back({scalar_id(f.at(0)), scalar_id(f.at(1)), f.at(2).get<double>()});
  }
  return graph;
}

}  // namespace

std::string SmoothingMapper::save() const {
  model::Json landmarks = model::Json::array(), candidates = model::Json::array(),
              nodes = model::Json::array(), bases = model::Json::array();
  for (const auto& [id, landmark] : store_.all()) landmarks.push_back(to_value(landmark));
  for (const Candidate& candidate : candidates_) candidates.push_back(to_value(candidate));
  for (const Node& node : nodes_) {
    model::Json seen = model::Json::array();
    for (const auto& [id, factor] : node.observations) seen.push_back({id, index(factor)});
    nodes.push_back({index(node.centre), seen, node.is_stationary});
  }
  for (const Base& base : bases_)
    bases.push_back({base.node, base.sequence, base.utime, base.centre_T_base, base.is_origin,
                     base.centre_T_middle});
  model::Json last_member = nullptr;
  if (last_member_)
    last_member = {last_member_->node, last_member_->utime, last_member_->centre_T_vehicle,
                   to_value(last_member_->turn)};
  model::Json located = nullptr;
  if (located_) {
    located = {located_->utime, located_->map_T_vehicle, located_->step,
               model::matrix_to_json<3, 3>(located_->covariance)};
  }
  return model::to_state({{"version", kStateVersion},
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
                          {"last_base", model::optional_to_json(map_T_last_base_)},
                          {"last_utime", model::optional_to_json(last_utime_)},
                          {"first_offered", model::optional_to_json(first_offered_)},
                          {"start_covariance", model::matrix_to_json<2, 2>(start_covariance_m2_)},
                          {"located", located}});
}

void SmoothingMapper::load(const std::string& state) {
  const model::Json json = model::from_state(state);
  if (json.at("version").get<int>() != kStateVersion)
    throw std::invalid_argument("mapper: state of another version");
  SmoothingMapper loaded(parameters_);
  const factor_graph::plane::Graph graph = graph_from(json.at("graph"));
  loaded.smoother_.start_from(graph);
  loaded.landmark_of_point_.assign(graph.points.size(), 0);
  for (const model::Json& landmark : json.at("landmarks")) {
    const StoredLandmark one = stored_landmark_from(landmark);
    loaded.store_.restore(one);
    if (one.point) loaded.landmark_of_point_.at(index(*one.point)) = one.id;
  }
  loaded.store_.set_next_id(json.at("next_id").get<model::LandmarkId>());
  for (const model::Json& candidate : json.at("candidates"))
    loaded.candidates_.push_back(candidate_from(candidate));
  for (const model::Json& node : json.at("nodes")) {
    Node out{pose_id(node.at(0)), {}, node.at(2).get<bool>()};
    for (const model::Json& seen : node.at(1))
      out.observations[seen.at(0).get<model::LandmarkId>()] =
          factor_graph::plane::ObservationId(seen.at(1).get<std::uint32_t>());
    loaded.nodes_.push_back(std::move(out));
  }
  for (const model::Json& base : json.at("bases")) {
    loaded.add_base({base.at(0).get<NodeIndex>(), base.at(1).get<std::uint64_t>(),
                     base.at(2).get<model::Utime>(), base.at(3).get<geometry::SE2WithCovariance>(),
                     base.at(5).get<geometry::SE2>(), base.at(4).get<bool>()});
  }
  json.at("odometry").get_to(loaded.odometry_);
  loaded.gyro_.load(json.at("gyro"));
  json.at("map_was_given").get_to(loaded.map_was_given_);
  json.at("keyframes").get_to(loaded.keyframes_);
  const model::Json& last = json.at("last_member");
  if (!last.is_null()) {
    loaded.last_member_ =
        LastMember{last.at(0).get<NodeIndex>(), last.at(1).get<model::Utime>(),
                   last.at(2).get<geometry::SE2WithCovariance>(), gyro_rotation_from(last.at(3))};
  }
  loaded.map_T_last_base_ =
      model::optional_from_json<geometry::SE2WithCovariance>(json.at("last_base"));
  loaded.last_utime_ = model::optional_from_json<model::Utime>(json.at("last_utime"));
  loaded.first_offered_ = model::optional_from_json<model::Utime>(json.at("first_offered"));
  loaded.start_covariance_m2_ = model::matrix_from_json<2, 2>(json.at("start_covariance"));
  const model::Json& located = json.at("located");
  if (!located.is_null()) {
    loaded.located_ = LocatedScan{
        located.at(0).get<model::Utime>(), located.at(1).get<geometry::SE2>(),
        located.at(2).get<geometry::SE2>(), model::matrix_from_json<3, 3>(located.at(3))};
  }
  if (!loaded.nodes_.empty()) loaded.smoother_.update();
  for (const auto& [id, landmark] : loaded.store_.all()) loaded.changed_.push_back(id);
  *this = std::move(loaded);
}

}  // namespace understory::geoslam_mapper::smoothing
