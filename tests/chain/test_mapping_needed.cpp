// Whether a drive says that mapping is needed: what counts of its messages, areas by hand, and one
// forest through the whole chain.
#include <map>
#include <string>

#include "eval/experiments/changing_forest/mapping_needed.hpp"
#include "eval/harness/drive_map.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::experiments::changing_forest;
using understory::eval::harness::MappingSignal;

namespace {

NeedScore score_of(double changed, std::array<double, 3> most) {
  return {{"by hand", Part::kChanges, changed}, 1, most, 0.0};
}

}  // namespace

TEST_CASE("The signals of a drive are the most that it said", "[existence]") {
  const std::vector<MappingSignal> signals{
      {0.0, 0.0, false}, {0.5, 0.1, true}, {0.3, 0.4, false}, {0.1, 0.0, false}};
  const NeedScore score = need_of({"by hand", Part::kChanges, 0.2}, 7, signals);
  CHECK(score.most[0] == Approx(0.5));
  CHECK(score.most[1] == Approx(0.4));
  CHECK(score.most[2] == Approx(0.7));  // Of one moment, not 0.5 + 0.4.
  CHECK(score.needed_pct == Approx(25.0));
  CHECK(need_of({}, 7, {}).needed_pct == 0.0);
}

TEST_CASE("Areas compare one share of change with all that did not change", "[existence]") {
  const std::vector<NeedScore> scores{
      score_of(0.0, {0.1, 0.2, 0.3}), score_of(0.0, {0.3, 0.2, 0.5}),
      score_of(0.1, {0.2, 0.2, 0.4}), score_of(0.5, {0.9, 0.1, 1.0})};
  std::map<std::pair<double, std::string>, double> areas;
  for (const auto& row : need_areas(scores))
    if (row["has_false"]) areas[{row["changed_pct"], row["signal"]}] = row["auc"].get<double>();
  CHECK(areas.size() == 6);
  CHECK(areas.at({10.0, "missing"}) == Approx(0.5));  // Above one, below the other.
  CHECK(areas.at({10.0, "new"}) == Approx(0.5));      // Ties.
  CHECK(areas.at({50.0, "missing"}) == Approx(1.0));
  CHECK(areas.at({50.0, "new"}) == Approx(0.0));

  // A drive with false detections counts in the second comparison alone.
  std::vector<NeedScore> more = scores;
  more.push_back({{"false", Part::kFalseDetections, 0.0, 0.3}, 1, {1.0, 1.0, 2.0}, 0.0});
  for (const auto& row : need_areas(more)) {
    CAPTURE(row.dump());
    CHECK(row["unchanged_drives"] == (row["has_false"] ? 3.0 : 2.0));
    if (row["changed_pct"] == 50.0 && row["signal"] == "sum")
      CHECK(row["auc"].get<double>() == Approx(row["has_false"] ? 2.0 / 3.0 : 1.0));
  }
}

TEST_CASE("A forest of which half was felled asks for mapping, the same one untouched does not",
          "[existence]") {
  const auto most_asked = [](double changed) {
    DrivesOptions options;
    options.config_dir = UNDERSTORY_SOURCE_CONFIG "/lidar";
    options.forest.course.length_m = 60.0;
    options.forest.drives = 2;
    options.forest.share = changed;
    options.columns = 900;
    const eval::harness::MapFolder folder("test-mapping-needed");
    const auto scores =
        drive_forest(forest_for(Part::kChanges, options, 11), options,
                     {Part::kChanges, Keeping::kTracker, 0.0}, 11, folder.path(), [](double) {});
    return need_of({"", Part::kChanges, changed}, 11, scores.back().signals);
  };

  CHECK(most_asked(0.5).needed_pct > 20.0);
  const NeedScore unchanged = most_asked(0.0);
  CHECK(unchanged.needed_pct == 0.0);
  CHECK(unchanged.most[2] < 0.2);
}
