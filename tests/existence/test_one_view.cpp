// What is missed from one place: one thing may stand in the way of all of it.
#include <algorithm>
#include <cstring>
#include <vector>

#include "tests/catch.hpp"
#include "tests/existence/existence_scene.hpp"

using namespace understory;
using namespace understory::existence;
using test::IcosahedralPoint;
using test::look_from_face;

namespace {

constexpr double kDay_s = 86400.0;
constexpr double kRemovedBelow = 0.2;

/// A quarter of the points goes in a month, as far as is known.
Parameters changing_world() {
  Parameters parameters;
  parameters.decay_per_s = 0.25 / (30.0 * kDay_s);
  parameters.decay_weight = 2.0;
  return parameters;
}

/// Drives that see nine of ten looks at what is there and not hidden.
class Drives {
 public:
  Drives(int points, std::uint64_t seed) : model_(changing_world()), random_(seed) {
    for (int i = 0; i < points; ++i)
      points_.push_back(IcosahedralPoint::born(model_, look_from_face(i % kFaces)));
    look_from_all_sides();
    begin(kDay_s);
    look_from_all_sides();
    learn();
  }
  void begin(double after_s) {
    const Elapsed time = model_.elapsed(after_s);
    learn();
    model_.begin_drive();
    for (IcosahedralPoint& point : points_) {
      point.elapse(model_, time);
      point.enter_pass(model_);
    }
    learn();
  }
  void learn() {
    PassHistories histories;
    for (const IcosahedralPoint& point : points_) point.tell(histories);
    model_.learn(histories);
    for (IcosahedralPoint& point : points_) point.reconsider(model_);
  }
  /// `times` looks at each point: from a face of its own, or `next` faces on.
  template <typename CanBeSeen>
  void look(int times, int next, const CanBeSeen& can_be_seen) {
    for (std::size_t i = 0; i < points_.size(); ++i)
      for (int k = 0; k < times; ++k) look_at(i, next, can_be_seen(i));
  }
  void look_at(std::size_t i, int next, bool can_be_seen) {
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const bool is_seen = unit(random_) < 0.01 || (can_be_seen && unit(random_) < 0.9);
    const Look look = look_from_face((static_cast<int>(i) + next) % kFaces);
    is_seen ? points_[i].hit(model_, look) : points_[i].miss(model_, look);
  }
  double probability(std::size_t i) const { return points_[i].probability(); }
  const ExistenceModel& model() const { return model_; }

 private:
  void look_from_all_sides() {
    for (int face = 0; face < kFaces; ++face) look(2, face, [](std::size_t) { return true; });
  }
  ExistenceModel model_;
  std::mt19937_64 random_;
  std::vector<IcosahedralPoint> points_;
};

/// With v and what may be hidden as they are before a drive's first look.
ExistenceModel before_a_drive(double pass_recall) {
  Parameters parameters;
  parameters.pass_recall = pass_recall;
  parameters.learn_recall = true;
  ExistenceModel model(parameters);
  model.learn({});
  model.begin_drive();
  model.learn({});
  return model;
}

}  // namespace

TEST_CASE("An hour behind a van, a month after mapping, removes nothing that it hides",
          "[existence]") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Drives drives(40, seed);
    drives.begin(30.0 * kDay_s);
    drives.look(3600, 0, [](std::size_t i) { return i % 2 == 0; });
    drives.learn();
    CAPTURE(seed, drives.model().learned().now, drives.model().hidden());
    for (std::size_t i = 0; i < 40; ++i) REQUIRE(drives.probability(i) > kRemovedBelow);
    // When it drives on, what has gone is missed from everywhere.
    for (int next = 1; next < 5; ++next)
      drives.look(4, next, [](std::size_t i) { return i % 4 != 1; });
    drives.learn();
    for (std::size_t i = 0; i < 40; ++i)
      REQUIRE((i % 4 == 1 ? drives.probability(i) < kRemovedBelow : drives.probability(i) > 0.9));
  }
}

TEST_CASE(
    "A vehicle that creeps behind a van looks over the border of two sides, and removes nothing",
    "[existence]") {
  // A quarter of the points is looked at from two faces.
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Drives drives(40, seed);
    drives.begin(30.0 * kDay_s);
    for (int round = 0; round < 20; ++round) {
      drives.look(10, 0, [](std::size_t i) { return i % 2 == 0; });
      for (std::size_t i = 0; i < 40; ++i)
        if (i % 8 < 2) drives.look_at(i, 1, i % 2 == 0);
    }
    drives.learn();
    CAPTURE(seed, drives.model().learned().now, drives.model().hidden());
    for (std::size_t i = 0; i < 40; ++i) REQUIRE(drives.probability(i) > kRemovedBelow);
  }
}

TEST_CASE("What was felled leaves use when a drive goes along it", "[existence]") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Drives drives(200, seed);
    drives.begin(30.0 * kDay_s);
    for (int next = 0; next < 4; ++next)
      drives.look(4, next, [](std::size_t i) { return i >= 50; });
    drives.learn();
    CAPTURE(seed, drives.model().learned().now, drives.model().hidden());
    int left = 0;
    for (std::size_t i = 0; i < 50; ++i) left += drives.probability(i) < kRemovedBelow ? 1 : 0;
    CHECK(left >= 49);  // two false sightings keep one
    for (std::size_t i = 50; i < 200; ++i) REQUIRE(drives.probability(i) > 0.9);
  }
}

TEST_CASE("What is missed from one side is not blamed on what hides, where others are seen so",
          "[existence]") {
  // 400 points from one side each, as far beside a road; 40 of them went.
  Drives drives(400, 5);
  drives.begin(30.0 * kDay_s);
  drives.look(6, 0, [](std::size_t i) { return i % 10 != 0; });
  drives.learn();
  CHECK(drives.model().hidden() < 0.1);
  CHECK(drives.model().learned().now > 0.9);
}

TEST_CASE("Looks from many sides count in any order, by Bayes' rule over what may be hidden",
          "[existence]") {
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int trial = 0; trial < 200; ++trial) {
    const double v = 0.3 + 0.6 * unit(random);
    ExistenceModel model = before_a_drive(v);
    REQUIRE(model.hidden() > 0.1);
    const int sides = 1 + trial % 4;
    std::vector<int> faces;
    faces.reserve(static_cast<std::size_t>(sides) + 4);
    for (int i = 0; i < sides; ++i) faces.push_back(i);
    for (int i = 0; i < 4; ++i) faces.push_back(static_cast<int>(unit(random) * sides));
    auto point = IcosahedralPoint::known(model);
    for (const int face : faces) point.miss(model, look_from_face(face));
    std::ranges::shuffle(faces, random);
    auto other = IcosahedralPoint::known(model);
    for (const int face : faces) other.miss(model, look_from_face(face));
    REQUIRE(other.probability() == Approx(point.probability()).epsilon(1e-6));

    // The same looks where nothing hides: h of the mass is theirs that are not seen at all.
    Parameters plain;
    plain.pass_recall = model.recall().of_pass();
    ExistenceModel open(plain);
    auto in_the_open = IcosahedralPoint::known(open);
    for (const int face : faces) in_the_open.miss(open, look_from_face(face));
    const double before = odds_of(plain.prior), hidden = model.hidden() * hides_all(sides);
    const double seen_so = odds_of(in_the_open.probability()) / before;
    const double expected = before * (hidden + (1.0 - hidden) * seen_so);
    REQUIRE(odds_of(point.probability()) == Approx(expected).epsilon(0.01));
  }
}

TEST_CASE("A pass keeps from where it has looked, and what may hide it, when it is saved",
          "[existence]") {
  ExistenceModel model = before_a_drive(0.7);
  auto point = IcosahedralPoint::known(model);
  point.hit(model, look_from_face(2));
  point.miss(model, look_from_face(5));
  Look passed = look_from_face(7);
  passed.ray = Ray::kPassed;
  auto other = point;
  point.miss(model, passed);
  CHECK(point.looked_from() == ((1U << 2U) | (1U << 5U) | (1U << 7U)));
  CHECK(point.missed_from() == ((1U << 5U) | (1U << 7U)));
  CHECK(other.looked_from() == ((1U << 2U) | (1U << 5U)));

  for (IcosahedralPoint* one : {&point, &other}) {
    auto loaded = IcosahedralPoint::load(model, one->save());
    for (IcosahedralPoint* each : {one, &loaded}) {
      each->miss(model, look_from_face(9));
      each->hit(model, look_from_face(5));
      each->reconsider(model);
    }
    const auto a = one->save(), b = loaded.save();
    CHECK(std::memcmp(&a, &b, sizeof a) == 0);
  }
}

TEST_CASE("Points of before what may hide them was known are read: nothing does", "[existence]") {
  ExistenceModel model(test::plain_parameters());
  auto point = IcosahedralPoint::known(model);
  point.miss(model, look_from_face(1));
  auto older = point.save();
  older.version = 2;
  const auto loaded = IcosahedralPoint::load(model, older);
  CHECK(loaded.probability() == point.probability());
  CHECK(loaded.missed_from() == point.missed_from());
}
