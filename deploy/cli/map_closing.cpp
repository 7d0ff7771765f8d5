#include "deploy/cli/map_closing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "deploy/cli/failure.hpp"
#include "deploy/cli/loop_end.hpp"
#include "deploy/cli/stored_ties.hpp"

namespace understory::cli {
namespace {

using map_closure::Closure;
using map_closure::ClosureError;
using map_closure::PlacedEnd;

constexpr double kPerDegree = 180.0 / std::numbers::pi;

std::uint32_t map_with_submaps(const map_file::MapFile& file) {
  std::vector<std::uint32_t> ids;
  for (const map_file::MapSummary& map : file.maps())
    if (!file.submaps(map.map_id).empty()) ids.push_back(map.map_id);
  if (ids.empty()) throw ClosureError("no map in it has submaps: only a drive's file has them");
  if (ids.size() > 1)
    throw ClosureError(
        fmt::format("{} maps with submaps are in it: say which one by --map", ids.size()));
  return ids.front();
}

bool is_same(const model::LoopEnd& a, const model::LoopEnd& b) {
  return a.submap == b.submap && a.keyframe == b.keyframe;
}

void refuse_again(const MapToClose& read, const SaidClosure& said) {
  for (const model::LoopClosure& one : read.closures) {
    const bool is_known = (is_same(one.from, said.from) && is_same(one.to, said.to)) ||
                          (is_same(one.from, said.to) && is_same(one.to, said.from));
    if (is_known)
      throw ClosureError(
          fmt::format("not closed: {} and {} are closed already; --force closes them again",
                      said.from_text, said.to_text));
  }
}

/// The parts' motion, said or found.
Closure closure_of(const MapToClose& read, const SaidClosure& said, const PlacedEnd& from,
                   const PlacedEnd& to, const std::function<void(double)>& progress,
                   MadeClosure& made) {
  if (said.from_T_to) return closure_between(from, to, *said.from_T_to);
  made.found = find_closure(read.map, read.graph, from.part, to.part, {}, progress);
  if (!made.found->alignment.found())
    throw ClosureError(fmt::format(
        "not closed: {}; --x-m, --y-m and --theta-deg say a pose that is known otherwise",
        made.found->alignment.reason({})));
  return {from.part, to.part, made.found->from_T_to};
}

void refuse_contradiction(const MadeClosure& made, const Closure& closure) {
  const Eigen::Vector3d off =
      (made.expected.from_T_to.mean.inverse() * closure.from_T_to.mean).Log();
  throw ClosureError(fmt::format(
      "not closed: it contradicts the map beyond chance: {:.2f} m and {:.2f} deg off, chi2 {:.1f} "
      "where {:.1f} is the limit (3 degrees of freedom); --force closes it all the same",
      off.head<2>().norm(), std::abs(off.z()) * kPerDegree, made.expected.chi2,
      map_closure::kContradiction));
}

/// An end as the layer shows it: a submap by its origin and the keyframe nearest to that.
model::KeyframePose drawn_end(const MapToClose& read, const MadeClosure& made, std::size_t part,
                              const model::LoopEnd& end) {
  const auto& keyframes = read.graph.parts[part].keyframes;
  const geometry::SE2& origin = made.closed.poses[part];
  const auto of = [&](std::uint32_t k) -> const model::KeyframePose& {
    return made.map.keyframes[k];
  };
  if (end.submap == 0) {
    return of(*std::ranges::find_if(
        keyframes, [&](auto k) { return of(k).keyframe_sequence == end.keyframe; }));
  }
  model::KeyframePose drawn;
  drawn.map_T_vehicle = origin;
  const auto nearest = std::ranges::min_element(keyframes, {}, [&](auto k) {
    return (of(k).map_T_vehicle.translation() - origin.translation()).norm();
  });
  if (nearest != keyframes.end()) drawn.keyframe_sequence = of(*nearest).keyframe_sequence;
  return drawn;
}

void draw(const MapToClose& read, const Closure& closure, MadeClosure& made) {
  const auto from = drawn_end(read, made, closure.from, made.closure.from);
  const auto to = drawn_end(read, made, closure.to, made.closure.to);
  made.map.loop_closures.push_back({from.keyframe_sequence, to.keyframe_sequence,
                                    from.map_T_vehicle.translation(),
                                    to.map_T_vehicle.translation()});
}

}  // namespace

MapToClose read_map_to_close(const std::string& file, std::uint32_t map_id) {
  const map_file::MapFile opened(file, map_file::Access::kRead);
  if (map_id == 0) map_id = map_with_submaps(opened);
  MapToClose read;
  read.known = opened.maps();
  read.map = opened.read(map_id);
  const std::vector<model::Submap> submaps = opened.submaps(map_id);
  read.closures = opened.closures(map_id);
  read.graph = map_closure::part_graph(read.map, submaps, stored_ties(submaps), read.closures);
  return read;
}

map_file::Placement MadeClosure::placement(const MapToClose& read) const {
  map_file::Placement placement{{}, {closure}};
  for (std::size_t i = 0; i < read.graph.parts.size(); ++i) {
    if (read.graph.parts[i].submap != 0)
      placement.submaps.push_back({read.graph.parts[i].submap, closed.poses[i]});
  }
  return placement;
}

MadeClosure make_closure(const MapToClose& read, const SaidClosure& said, bool force,
                         const std::function<void(double)>& progress) {
  const PlacedEnd from = placed_end(read.map, read.graph, said.from, "--from " + said.from_text);
  const PlacedEnd to = placed_end(read.map, read.graph, said.to, "--to " + said.to_text);
  if (!force) refuse_again(read, said);
  MadeClosure made;
  const Closure closure = closure_of(read, said, from, to, progress, made);

  made.expected = expectation(read.graph, closure);
  if (made.expected.chi2 > map_closure::kContradiction && !force)
    refuse_contradiction(made, closure);

  const auto of_ends = [&](const geometry::SE2& from_T_to) {
    return from.part_T_end.inverse() * from_T_to * to.part_T_end;
  };
  made.before = of_ends(made.expected.from_T_to.mean);
  const geometry::SE2 pose = of_ends(closure.from_T_to.mean);
  made.closure.map_id = read.map.map_id;
  made.closure.source = "manual, in the file";
  made.closure.from = said.from;
  made.closure.to = said.to;
  made.closure.from_T_to.mean = pose;
  made.closure.id = manual_closure_id(fmt::format("{} {} {} {} {}", said.from_text, said.to_text,
                                                  pose.x(), pose.y(), pose.theta()));

  made.closed = closed(read.graph, closure);
  made.map = moved(read.map, read.graph, made.closed, made.shifts);
  made.doubles_before = coincident_pairs(read.map, read.graph, kCoincident_m);
  made.doubles = coincident_pairs(made.map, read.graph, kCoincident_m);
  draw(read, closure, made);
  return made;
}

}  // namespace understory::cli
