// The parts of the tracker, each alone: path, use, news, what all landmarks teach.
#include "services/existence_tracker/driven_path.hpp"
#include "services/existence_tracker/lessons.hpp"
#include "services/existence_tracker/news.hpp"
#include "services/existence_tracker/use_of_landmarks.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::existence_tracker;

namespace {

/// A landmark that so many passes saw, and so many missed in clear view.
TrackedPoint looked_at(existence::ExistenceModel& model, int hits, int misses) {
  const existence::Look look{Eigen::Vector3f(5.0F, 0.0F, 0.0F), existence::Ray::kPassed};
  TrackedPoint tracked{Point::known(model), 0};
  for (int i = 0; i < hits + misses; ++i) {
    model.begin_pass();
    if (i < hits) tracked.point.hit(model, look);
    if (i >= hits) tracked.point.miss(model, look);
  }
  return tracked;
}

}  // namespace

TEST_CASE("A driven path counts steps, and a jump of the map as a short one", "[existence]") {
  DrivenPath path;
  CHECK(path.place_m().isZero(0.0));
  path.drive_to({100.0, 0.0});  // The first place is no step.
  CHECK(path.along_m() == 0.0);
  path.drive_to({103.0, 4.0});
  CHECK(path.along_m() == Approx(5.0));
  path.drive_to({1103.0, 4.0});
  CHECK(path.along_m() == Approx(55.0));
  path.begin_pass();
  path.drive_to({1103.0, 6.0});
  CHECK(path.of_pass_m() == Approx(2.0));
  CHECK(path.place_m() == Eigen::Vector2d(1103.0, 6.0));
}

TEST_CASE("What is improbable leaves use and comes back, and is counted", "[existence]") {
  existence::ExistenceModel model(for_maps());
  UseOfLandmarks use({0.1, 0.5});
  TrackedPoint gone = looked_at(model, 0, 40);
  TrackedPoint seen = looked_at(model, 5, 0);
  REQUIRE(gone.point.probability() < 0.1);
  REQUIRE(seen.point.probability() > 0.5);

  use.decide(gone, true);
  use.decide(seen, true);
  CHECK_FALSE(gone.is_in_use);
  CHECK(gone.has_just_left);
  CHECK(seen.is_in_use);
  CHECK(use.unused() == 1);
  CHECK(use.dropped() == 1);
  use.take_back(gone, true);  // Still improbable.
  CHECK_FALSE(gone.is_in_use);

  gone.point = seen.point;  // Its looks turn out to have been hidden.
  use.take_back(gone, false);
  CHECK_FALSE(gone.is_in_use);
  use.take_back(gone, true);
  CHECK(gone.is_in_use);
  CHECK(use.unused() == 0);
  CHECK(use.readmitted() == 1);

  use.decide(seen, false);  // New, while most that is new is false.
  CHECK(use.unused() == 1);
  use.erase(seen);
  CHECK(use.unused() == 0);
}

TEST_CASE("What changed is told, and all others in turn", "[existence]") {
  existence::ExistenceModel model(for_maps());
  OutputParameters parameters;
  parameters.repeated = 2;
  News news(parameters);
  PointsById points;
  for (model::LandmarkId id = 1; id <= 5; ++id) {
    points.emplace(id, looked_at(model, 1, 0));
    points.at(id).told_probability = points.at(id).point.probability();
  }

  points.at(4).is_in_use = false;
  news.touch(4);
  news.touch(5);  // Looked at, and as it was told.
  news.touch(9);  // Gone since.
  CHECK(news.take_ids(points) == std::set<model::LandmarkId>{1, 2, 4});
  CHECK(news.take_ids(points) == std::set<model::LandmarkId>{3, 4});
  CHECK(news.take_ids(points) == std::set<model::LandmarkId>{1, 5});
  CHECK(news.take_ids({}).empty());
}

TEST_CASE("A state is due once, however often it changed", "[existence]") {
  existence::ExistenceModel model(for_maps());
  News news;
  TrackedPoint a = looked_at(model, 1, 0), b = looked_at(model, 1, 0);
  a.state_is_due = b.state_is_due = false;
  news.make_due(7, a);
  news.make_due(3, b);
  news.make_due(7, a);
  CHECK(a.state_is_due);
  CHECK(news.take_due() == std::vector<model::LandmarkId>{3, 7});
  CHECK(news.take_due().empty());
}

TEST_CASE("Each landmark is judged once by what all have taught", "[existence]") {
  Lessons lessons(for_maps());
  PointsById points;
  for (model::LandmarkId id = 1; id <= 30; ++id) {
    TrackedPoint& one = points.emplace(id, looked_at(lessons.model(), 3, 0)).first->second;
    lessons.begin(id, one);
  }
  CHECK_FALSE(lessons.judge(1, points.at(1)));  // Nothing was learned since it began.

  lessons.learn(points, 120.0);
  CHECK(lessons.learned_m() == 120.0);
  CHECK(points.at(1).is_among_histories);
  CHECK_FALSE(lessons.is_judged(points.at(1)));
  CHECK(lessons.judge(1, points.at(1)));
  CHECK_FALSE(lessons.judge(1, points.at(1)));
  CHECK_FALSE(points.at(1).is_among_histories);  // It changed: counted at the next sum.

  const existence::PassHistories before = lessons.histories(points);
  lessons.forget(points.at(2));
  points.erase(2);
  CHECK_FALSE(lessons.histories(points) == before);
  lessons.learn(points, 240.0);
  existence::PassHistories anew;
  for (const auto& [id, tracked] : points) tracked.point.tell(anew);
  CHECK(lessons.histories(points) == anew);
}

TEST_CASE("Where most of what is new is false, nothing new is used", "[existence]") {
  Lessons lessons(for_maps());
  CHECK(lessons.are_new_ones_used());
  for (int i = 0; i < 40; ++i) {
    TrackedPoint ghost = looked_at(lessons.model(), 0, 40);
    ghost.is_confirmed = false;
    ghost.is_first_pass = true;
    lessons.count_false(ghost, 0.1);  // In its first pass nothing counts.
    ghost.is_first_pass = false;
    lessons.count_false(ghost, 0.1);
    lessons.count_false(ghost, 0.1);
    CHECK(ghost.is_counted);
  }
  CHECK_FALSE(lessons.are_new_ones_used());

  // What was learned goes on in another process.
  Lessons next(for_maps());
  next.take(lessons.encoded());
  CHECK_FALSE(next.are_new_ones_used());
  for (int i = 0; i < 60; ++i) {
    TrackedPoint tree = looked_at(next.model(), 5, 0);
    tree.is_confirmed = false;
    next.confirm(tree);
    next.confirm(tree);  // Once.
  }
  CHECK(next.are_new_ones_used());
}
