#include "services/geoslam_mapper/baseline/mapper_state.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

namespace understory::geoslam_mapper::baseline {
namespace {

using Json = nlohmann::json;

Json to_json(const Eigen::Vector2d& v) { return Json::array({v.x(), v.y()}); }
Json to_json(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }
Eigen::Vector2d vector2_from(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>()};
}
Eigen::Vector3d vector3_from(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

template <typename T, typename Convert>
Json list_to_json(const std::vector<T>& items, Convert convert) {
  Json list = Json::array();
  for (const T& item : items) {
    list.push_back(convert(item));
  }
  return list;
}

template <typename T, typename Convert>
std::vector<T> list_from(const Json& json, Convert convert) {
  std::vector<T> items;
  for (const Json& item : json) {
    items.push_back(convert(item));
  }
  return items;
}

Json to_json(const Graph& graph) {
  const auto vector2 = [](const Eigen::Vector2d& v) { return to_json(v); };
  const auto vector3 = [](const Eigen::Vector3d& v) { return to_json(v); };
  return {{"poses", list_to_json(graph.poses, vector3)},
          {"landmarks", list_to_json(graph.landmarks_m, vector2)},
          {"pose_edges", list_to_json(graph.pose_edges,
                                      [](const PoseEdge& e) {
                                        return Json::array({e.from, e.to, to_json(e.difference)});
                                      })},
          {"landmark_edges", list_to_json(graph.landmark_edges, [](const LandmarkEdge& e) {
             return Json::array({e.pose, e.landmark, to_json(e.measured_m)});
           })}};
}

Graph graph_from(const Json& json) {
  Graph graph;
  graph.poses = list_from<Eigen::Vector3d>(json.at("poses"), vector3_from);
  graph.landmarks_m = list_from<Eigen::Vector2d>(json.at("landmarks"), vector2_from);
  graph.pose_edges = list_from<PoseEdge>(json.at("pose_edges"), [](const Json& e) {
    return PoseEdge{e.at(0).get<std::uint32_t>(), e.at(1).get<std::uint32_t>(),
                    vector3_from(e.at(2))};
  });
  graph.landmark_edges = list_from<LandmarkEdge>(json.at("landmark_edges"), [](const Json& e) {
    return LandmarkEdge{e.at(0).get<std::uint32_t>(), e.at(1).get<std::uint32_t>(),
                        vector2_from(e.at(2))};
  });
  return graph;
}

Json to_json(const DiscoveryNetwork& network) {
  Json nodes = Json::array();
  for (const auto& [id, node] : network.nodes()) {
    nodes.push_back({id, to_json(node.observation.in_map_m), to_json(node.observation.in_pose_m),
                     node.observation.radius_m, static_cast<int>(node.observation.kind),
                     node.observation.observation_count, node.neighbours});
  }
  return {{"nodes", std::move(nodes)}, {"poses", network.poses()}};
}

DiscoveryNetwork network_from(const Json& json) {
  std::map<ObservationKey, DiscoveryNetwork::Node> nodes;
  for (const Json& node : json.at("nodes")) {
    nodes.emplace(node.at(0).get<ObservationKey>(),
                  DiscoveryNetwork::Node{
                      {vector2_from(node.at(1)), vector2_from(node.at(2)), node.at(3).get<double>(),
                       static_cast<model::LandmarkKind>(node.at(4).get<int>()),
                       node.at(5).get<std::uint16_t>()},
                      node.at(6).get<std::set<ObservationKey>>()});
  }
  return {std::move(nodes), json.at("poses").get<std::set<std::uint32_t>>()};
}

}  // namespace

std::string save(const MapperState& state) {
  const Json json{
      {"graph", to_json(state.map.graph)},
      {"landmarks",
       list_to_json(
           state.map.landmarks,
           [](const LandmarkRecord& r) {
             return Json::array({r.id, r.radius_m, r.observation_count, static_cast<int>(r.kind)});
           })},
      {"poses", list_to_json(state.map.poses,
                             [](const PoseRecord& r) {
                               return Json::array({r.keyframe_sequence, r.utime});
                             })},
      {"last_id", state.map.last_id},
      {"network", to_json(state.map.network)},
      {"hierarchy_points", list_to_json(state.hierarchy_points_m,
                                        [](const Eigen::Vector2d& v) { return to_json(v); })}};
  std::string bytes;
  Json::to_cbor(json, bytes);
  return bytes;
}

MapperState load_mapper_state(const std::string& bytes, double descriptor_step) {
  try {
    const Json json = Json::from_cbor(bytes);
    MapperState state;
    state.map.graph = graph_from(json.at("graph"));
    state.map.landmarks = list_from<LandmarkRecord>(json.at("landmarks"), [](const Json& r) {
      return LandmarkRecord{r.at(0).get<model::LandmarkId>(), r.at(1).get<double>(),
                            r.at(2).get<std::uint32_t>(),
                            static_cast<model::LandmarkKind>(r.at(3).get<int>())};
    });
    state.map.poses = list_from<PoseRecord>(json.at("poses"), [](const Json& r) {
      return PoseRecord{r.at(0).get<std::uint64_t>(), r.at(1).get<model::Utime>()};
    });
    json.at("last_id").get_to(state.map.last_id);
    state.map.network = network_from(json.at("network"));
    state.hierarchy_points_m =
        list_from<Eigen::Vector2d>(json.at("hierarchy_points"), vector2_from);
    state.hierarchy = hierarchy::baseline::Hierarchy(state.hierarchy_points_m, descriptor_step);
    if (!state.hierarchy_points_m.empty()) {
      state.hierarchy.move_points(state.map.graph.landmarks_m);
    }
    return state;
  } catch (const Json::exception& error) {
    throw std::invalid_argument(std::string("state of the source's mapper: ") + error.what());
  }
}

}  // namespace understory::geoslam_mapper::baseline
