// The landmark grid and its triangles against brute force, under thousands of random changes.
#include <algorithm>
#include <map>
#include <random>

#include "common/constellation/map.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::constellation;

namespace {

using Model = std::map<LandmarkId, Eigen::Vector2d>;
using Triple = std::array<LandmarkId, 3>;

std::vector<LandmarkId> brute_force_neighbours(const Model& model, LandmarkId id, double limit_m) {
  std::vector<std::pair<double, LandmarkId>> order;
  for (const auto& [other, position] : model) {
    const double squared = (position - model.at(id)).squaredNorm();
    if (other != id && squared <= limit_m * limit_m) order.emplace_back(squared, other);
  }
  std::sort(order.begin(), order.end());
  order.resize(std::min(order.size(), ConstellationMap::kNeighbours));
  std::vector<LandmarkId> ids;
  for (const auto& entry : order) ids.push_back(entry.second);
  return ids;
}

std::vector<Triple> brute_force_triangles(const Model& model, double limit_m) {
  std::vector<Triple> triangles;
  for (const auto& entry : model) {
    const auto near = brute_force_neighbours(model, entry.first, limit_m);
    for (std::size_t i = 0; i < near.size(); ++i) {
      for (std::size_t j = i + 1; j < near.size(); ++j) {
        Triple triangle{entry.first, near[i], near[j]};
        std::sort(triangle.begin(), triangle.end());
        triangles.push_back(triangle);
      }
    }
  }

  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());

  return triangles;
}

/// Random insertions, removals and moves, near and far; applied to both.
class RandomChanges {
 public:
  RandomChanges(std::uint64_t seed, double extent_m, bool lattice)
      : random_(seed), uniform_(-extent_m, extent_m), lattice_(lattice) {}

  void apply(ConstellationMap& map, Model& model) {
    const int what = std::uniform_int_distribution<int>(0, 9)(random_);
    if (what < 5 || model.size() < 3) {
      const LandmarkId id = random_() % 5000;
      const Eigen::Vector2d position = draw();
      const bool is_new = model.find(id) == model.end();
      REQUIRE(map.insert(id, position) == is_new);
      model.emplace(id, position);
    } else {
      auto it = model.begin();
      std::advance(it, static_cast<long>(random_() % model.size()));
      if (what < 8) {
        it->second = what == 5 ? draw() : Eigen::Vector2d(it->second + 0.01 * draw());
        const bool waits = random_() % 2 == 0;
        REQUIRE((waits ? map.shift(it->first, it->second) : map.move(it->first, it->second)));
        REQUIRE(*map.position(it->first) == it->second);
        REQUIRE_FALSE((waits && map.is_settled()));
      } else {
        REQUIRE(map.remove(it->first));
        REQUIRE_FALSE(map.remove(it->first));
        model.erase(it);
      }
    }
  }
  Eigen::Vector2d draw() {
    Eigen::Vector2d point(uniform_(random_), uniform_(random_));
    // Equal distances everywhere: only the ids order the neighbours.
    if (lattice_) point = (point / 5.0).array().round() * 5.0;
    return point;
  }

 private:
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> uniform_;
  bool lattice_;
};

Model clustered_model(std::mt19937_64& random, int n) {
  std::uniform_real_distribution<double> place(-200, 200);
  std::normal_distribution<double> spread(0.0, 6.0);
  Model model;
  Eigen::Vector2d centre(0, 0);
  for (int i = 0; i < n; ++i) {
    if (i % 12 == 0) centre = {place(random), place(random)};
    model[random() >> 1] = centre + Eigen::Vector2d(spread(random), spread(random));
  }
  return model;
}

}  // namespace

TEST_CASE("Triangles after random changes equal those made by brute force", "[constellation]") {
  for (const bool lattice : {false, true}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const double extent_m = seed == 3 ? 400.0 : 60.0;  // 3: so sparse that the limit matters
      RandomChanges changes(seed, extent_m, lattice);
      ConstellationMap map;
      Model model;

      for (int i = 0; i < 4000; ++i) {
        changes.apply(map, model);
        if (i % 400 == 399 || i < 12) {
          map.settle();
          REQUIRE(map.is_settled());
          REQUIRE(map.size() == model.size());
          REQUIRE(map.triangles() == brute_force_triangles(model, 30.0));
        }
      }

      while (!model.empty()) {
        REQUIRE(map.remove(model.begin()->first));
        model.erase(model.begin());
      }

      REQUIRE(map.triangle_count() == 0);
    }
  }
}

TEST_CASE("Triangles of many landmarks in a few places equal brute force", "[constellation]") {
  std::mt19937_64 random(9);
  ConstellationMap map;
  Model model;
  for (int i = 0; i < 150; ++i) {
    const auto id = static_cast<LandmarkId>(random() % 100000);
    if (model.contains(id)) continue;
    const Eigen::Vector2d place(static_cast<double>(random() % 5), 2.0);
    model.emplace(id, place);
    REQUIRE(map.insert(id, place));
    if (i % 3 == 2) {
      const auto one = std::next(model.begin(), static_cast<long>(random() % model.size()));
      one->second.x() = static_cast<double>(random() % 5);
      REQUIRE(map.move(one->first, one->second));
    }
    if (i % 10 == 9) REQUIRE(map.triangles() == brute_force_triangles(model, 30.0));
  }
  while (!model.empty()) {
    REQUIRE(map.remove(model.begin()->first));
    model.erase(model.begin());
    if (model.size() % 10 == 0) REQUIRE(map.triangles() == brute_force_triangles(model, 30.0));
  }
}

TEST_CASE("Landmarks that wait for their triangles are found where they are", "[constellation]") {
  std::mt19937_64 random(8);
  std::normal_distribution<double> step;
  Model model = clustered_model(random, 400);
  ConstellationMap waiting;
  for (const auto& [id, position] : model) waiting.insert(id, position);
  const auto triangles = waiting.triangles();

  // The map drifts as a whole, a little further each time.
  for (int i = 0; i < 20; ++i) {
    for (auto& [id, position] : model) {
      position += Eigen::Vector2d(0.3 + 0.01 * step(random), 0.1 * step(random));
      REQUIRE(waiting.shift(id, position));
    }
  }
  CHECK(waiting.triangles() == triangles);
  ConstellationMap made;
  for (const auto& [id, position] : model) made.insert(id, position);
  for (const auto& [id, position] : model)
    REQUIRE(waiting.near({position, 10.0}) == made.near({position, 10.0}));

  // Some go meanwhile, and others take their slots.
  for (int i = 0; i < 50; ++i) {
    const auto gone = std::next(model.begin(), static_cast<long>(random() % model.size()));
    REQUIRE(waiting.remove(gone->first));
    model.erase(gone);
  }
  for (LandmarkId id = 1; id <= 25; ++id) {
    model[id] = {10.0 * step(random), 10.0 * step(random)};
    REQUIRE(waiting.insert(id, model[id]));
  }
  waiting.settle();
  REQUIRE(waiting.triangles() == brute_force_triangles(model, 30.0));
  REQUIRE_FALSE(waiting.shift(1, {std::nan(""), 0.0}));
  REQUIRE_FALSE(waiting.shift(26, {0.0, 0.0}));
  REQUIRE(waiting.is_settled());
}

TEST_CASE("Triangles do not depend on the order of insertion", "[constellation]") {
  std::mt19937_64 random(4);
  const Model model = clustered_model(random, 600);
  std::vector<std::pair<LandmarkId, Eigen::Vector2d>> order(model.begin(), model.end());
  ConstellationMap first;
  for (const auto& [id, position] : order) first.insert(id, position);
  std::shuffle(order.begin(), order.end(), random);
  ConstellationMap second;
  for (const auto& [id, position] : order) second.insert(id, position);
  REQUIRE(first.triangles() == second.triangles());
  REQUIRE(first.triangles() == brute_force_triangles(model, 30.0));
}

TEST_CASE("Nearest and all landmarks within a radius equal brute force", "[constellation]") {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(-220, 220);
  std::uniform_real_distribution<double> radius(0.0, 40.0);
  const Model model = clustered_model(random, 800);

  for (const double cell_m : {1.0, 4.0, 17.0}) {
    ConstellationMap::Parameters parameters;
    parameters.cell_m = cell_m;
    ConstellationMap map(parameters);
    for (const auto& [id, position] : model) map.insert(id, position);

    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector2d point(place(random), place(random));
      // Now and then a radius with more cells than there is time to visit.
      const double r = i % 500 == 499 ? 1e6 : radius(random);
      std::vector<LandmarkId> within;
      std::pair<double, LandmarkId> best(r, 0);
      bool any = false;

      for (const auto& [id, position] : model) {
        const double distance = (position - point).norm();
        if (distance > r) continue;
        within.push_back(id);
        if (!any || distance < best.first) best = {distance, id};
        any = true;
      }

      REQUIRE(map.near({point, r}) == within);
      const auto nearest = map.nearest(point, r);
      REQUIRE(nearest.has_value() == any);
      if (any) REQUIRE(nearest->id == best.second);
    }
  }
}

TEST_CASE("What was removed is not found again, within any radius", "[constellation]") {
  std::mt19937_64 random(6);
  Model model = clustered_model(random, 300);
  ConstellationMap map;
  for (const auto& [id, position] : model) map.insert(id, position);
  while (!model.empty()) {
    REQUIRE(map.remove(model.begin()->first));
    model.erase(model.begin());
    if (model.size() % 10 != 0) continue;
    // Few cells, many, and more than there is time to visit.
    for (const double radius_m : {30.0, 1e3, 1e6}) {
      std::vector<LandmarkId> within;
      for (const auto& [id, position] : model) {
        if (position.norm() <= radius_m) within.push_back(id);
      }
      REQUIRE(map.near({{0.0, 0.0}, radius_m}) == within);
    }
  }
}

TEST_CASE("Positions that cannot be stored are refused", "[constellation]") {
  ConstellationMap map;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  REQUIRE_FALSE(map.insert(1, {nan, 0.0}));
  REQUIRE_FALSE(map.insert(1, {0.0, std::numeric_limits<double>::infinity()}));
  REQUIRE_FALSE(map.insert(1, {0.0, 1e12}));
  constexpr double kMost = PointGrid::kMaxCoordinate;
  const double beyond = std::nextafter(kMost, 2.0 * kMost);
  for (const double side : {-1.0, 1.0}) {
    REQUIRE_FALSE(map.insert(1, {side * beyond, 0.0}));
    REQUIRE_FALSE(map.insert(1, {0.0, side * beyond}));
    REQUIRE(map.insert(1, {side * kMost, side * kMost}));
    REQUIRE(map.near({{side * kMost, side * kMost}, 1.0}).size() == 1);
    REQUIRE(map.remove(1));
  }
  REQUIRE(map.size() == 0);
  REQUIRE(map.insert(1, {1.0, 2.0}));
  REQUIRE_FALSE(map.move(1, {nan, 0.0}));
  REQUIRE_FALSE(map.move(2, {0.0, 0.0}));
  REQUIRE(*map.position(1) == Eigen::Vector2d(1.0, 2.0));
  REQUIRE_FALSE(map.position(2).has_value());
  REQUIRE_FALSE(map.nearest({nan, 0.0}, 1.0).has_value());
}
