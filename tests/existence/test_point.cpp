// One point: the numbers of the specification, occluders, rays, limits, saved state.
#include "common/existence/point.hpp"

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "common/existence/von_mises_fisher_shell.hpp"
#include "tests/catch.hpp"
#include "tests/existence/existence_scene.hpp"

using namespace understory;
using namespace understory::existence;
using test::IcosahedralPoint;
using test::look_from_face;

namespace {

const double kNaN = std::numeric_limits<double>::quiet_NaN();

/// All of a saved point.
template <typename Saved>
std::vector<std::byte> bytes_of(const Saved& saved) {
  const auto bytes = std::as_bytes(std::span(&saved, 1));
  return {bytes.begin(), bytes.end()};
}

/// Hits enough for certainty.
template <typename Point>
void confirm(ExistenceModel& model, Point& point, int face) {
  for (int i = 0; i < 20; ++i) point.hit(model, look_from_face(face));
}

}  // namespace

TEST_CASE("Blame is shared between gone and hidden as the specification says", "[existence]") {
  ExistenceModel model(test::plain_parameters());
  auto point = IcosahedralPoint::known(model);
  point.miss(model, look_from_face(0));
  CHECK(point.probability() == Approx(0.935).margin(0.0005));
  point.miss(model, look_from_face(0));
  point.miss(model, look_from_face(0));
  CHECK(point.probability() == Approx(0.835).margin(0.0005));
  for (int look = 3; look < 36000; ++look) point.miss(model, look_from_face(0));
  CHECK(point.probability() == Approx(0.83).margin(0.005));

  auto around = IcosahedralPoint::known(model);
  for (const int face : {0, 1, 2, 3}) around.miss(model, look_from_face(face));
  CHECK(around.probability() == Approx(0.042).margin(0.0005));
}

TEST_CASE("An hour behind a parked lorry deletes nothing, also with time going on", "[existence]") {
  ExistenceModel model(test::plain_parameters());
  auto point = IcosahedralPoint::known(model);
  const Elapsed tenth = model.elapsed(0.1);
  for (int look = 0; look < 36000; ++look) {
    point.miss(model, look_from_face(7));
    point.elapse(model, tenth);
  }
  // What mu re-admits in an hour is less than the evidence of one frame (a factor 0.145).
  CHECK(point.probability() > 0.75);

  auto seen = IcosahedralPoint::known(model);
  confirm(model, seen, 3);
  model.begin_pass();
  for (int look = 0; look < 36000; ++look) seen.miss(model, look_from_face(7));
  CHECK(seen.probability() > 0.999);
}

TEST_CASE("Ten passes from ten directions delete", "[existence]") {
  Parameters parameters = test::plain_parameters();
  const double v = GENERATE(1.0, 0.64);
  parameters.pass_recall = v;
  ExistenceModel model(parameters);
  auto point = IcosahedralPoint::known(model);
  for (int pass = 0; pass < 10; ++pass) {
    model.begin_pass();
    for (int look = 0; look < 20; ++look) point.miss(model, look_from_face(2 * pass));
  }
  CHECK(point.probability() < 0.02);
}

TEST_CASE("A pass that misses says no more than that passes miss", "[existence]") {
  Parameters parameters = test::plain_parameters();
  parameters.pass_recall = 0.64;
  ExistenceModel model(parameters);
  auto point = IcosahedralPoint::known(model);
  for (int face = 0; face < kFaces; ++face) {
    for (int look = 0; look < 50; ++look) point.miss(model, look_from_face(face));
  }
  const double least = 99.0 * 0.36;
  CHECK(point.probability() == Approx(least / (1.0 + least)).epsilon(0.01));
  // Seen on the next pass: there, and every direction is as good as it was.
  model.begin_pass();
  for (int look = 0; look < 3; ++look) point.hit(model, look_from_face(4));
  CHECK(point.probability() > 0.9999);
}

TEST_CASE("Missed on two drives and seen on the third: in use again", "[existence]") {
  Parameters parameters;
  parameters.pass_recall = 0.64;
  ExistenceModel model(parameters);
  auto point = IcosahedralPoint::known(model);
  for (int drive = 0; drive < 3; ++drive) {
    model.begin_pass();
    for (int look = 0; look < 30; ++look) {
      if (drive == 2 && look % 3 != 0)
        point.hit(model, look_from_face(look / 10));
      else
        point.miss(model, look_from_face(look / 10));
    }
    if (drive == 1) CHECK(point.probability() < 0.97);
  }
  CHECK(point.probability() > 0.9999);
}

TEST_CASE("Returns in front say nothing, returns behind say gone", "[existence]") {
  ExistenceModel model(test::plain_parameters());
  auto point = IcosahedralPoint::known(model);
  Look look = look_from_face(5);
  look.ray = Ray::kBlocked;
  for (int i = 0; i < 1000; ++i) point.miss(model, look);
  CHECK(point.probability() == Approx(0.99));
  CHECK(point.shell().face_visibility(5) == Approx(0.95));

  auto plain = point;
  auto passed = point;
  plain.miss(model, look_from_face(5));
  look.ray = Ray::kPassed;
  passed.miss(model, look);
  CHECK(passed.probability() < plain.probability());
  const double once = passed.probability();
  // One viewpoint's rays pass for one reason.
  auto known_free = point;
  known_free.miss(model, look);
  CHECK(known_free.probability() == Approx(once));
  CHECK(ray_of(9.0, 10.0, 0.5) == Ray::kBlocked);
  CHECK(ray_of(10.4, 10.0, 0.5) == Ray::kUnknown);
  CHECK(ray_of(12.0, 10.0, 0.5) == Ray::kPassed);
}

TEST_CASE("Misses beyond the reach say nothing; hits extend it", "[existence]") {
  ExistenceModel model(test::plain_parameters());
  auto point = IcosahedralPoint::known(model);
  point.miss(model, look_from_face(1, 60.0));
  CHECK(point.probability() == Approx(0.99));
  point.hit(model, look_from_face(1, 60.0));
  auto after = point;
  after.miss(model, look_from_face(1, 60.0));
  CHECK(after.probability() <= point.probability());
  CHECK(after.shell().face_visibility(1) < point.shell().face_visibility(1));
}

TEST_CASE("A thousand million looks: finite, monotone, no drift", "[existence]") {
  ExistenceModel model(test::plain_parameters());
  auto point = IcosahedralPoint::known(model);
  double last = 1.0;
  for (int look = 0; look < 20000; ++look) {
    point.miss(model, look_from_face(look % kFaces));
    REQUIRE(point.probability() <= last);
    last = point.probability();
  }
  // The state is a fixed point: any further number of misses leaves the same bytes.
  const auto state = point.save();
  for (int look = 0; look < kFaces; ++look) point.miss(model, look_from_face(look));
  const auto later = point.save();
  CHECK(bytes_of(state) == bytes_of(later));
  CHECK(point.probability() == Approx(1e-6));

  auto seen = IcosahedralPoint::known(model);
  for (int look = 0; look < 2000; ++look) seen.hit(model, look_from_face(look % kFaces));
  const auto at_most = seen.save();
  for (int look = 0; look < kFaces; ++look) seen.hit(model, look_from_face(look));
  const auto still = seen.save();
  CHECK(bytes_of(at_most) == bytes_of(still));
  CHECK(seen.probability() == Approx(1.0 - 1e-6));
}

TEST_CASE("From one side alone a point is never deleted, however long", "[existence]") {
  ExistenceModel model(test::plain_parameters());
  auto point = IcosahedralPoint::known(model);
  for (int look = 0; look < 3000; ++look) point.miss(model, look_from_face(9));
  const auto state = point.save();
  for (int look = 0; look < 1000; ++look) point.miss(model, look_from_face(9));
  const auto later = point.save();
  // The face is at its least, where a miss moves P by less than one bit.
  CHECK(bytes_of(state) == bytes_of(later));
  CHECK(point.probability() > 0.8);
}

TEST_CASE("Time is the same in one part and in many", "[existence]") {
  Parameters parameters = test::plain_parameters();
  parameters.decay_per_s = 1e-6;
  ExistenceModel model(parameters);
  auto once = IcosahedralPoint::known(model);
  for (int i = 0; i < 9; ++i) once.miss(model, look_from_face(0));
  auto often = once;
  once.elapse(model, model.elapsed(36000.0));
  for (int i = 0; i < 36000; ++i) often.elapse(model, model.elapsed(1.0));
  CHECK(often.probability() == Approx(once.probability()).epsilon(1e-6));
  CHECK(often.shell().face_visibility(0) == Approx(once.shell().face_visibility(0)).epsilon(1e-3));

  auto aged = IcosahedralPoint::known(model);
  aged.elapse(model, model.elapsed(1e6));
  CHECK(aged.probability() == Approx(0.99 * std::exp(-1.0)));
  aged.elapse(model, model.elapsed(1e12));
  CHECK(aged.probability() == Approx(1e-6));
}

TEST_CASE("A point that is born dies when it is not seen again", "[existence]") {
  ExistenceModel model{Parameters{}};
  auto point = IcosahedralPoint::born(model, look_from_face(0));
  CHECK(point.probability() == Approx(0.7));
  for (int look = 0; look < 5; ++look) point.miss(model, look_from_face(0));
  CHECK(point.probability() < 0.25);
  auto real = IcosahedralPoint::born(model, look_from_face(0));
  real.hit(model, look_from_face(0));
  CHECK(real.probability() > 0.99);
}

TEST_CASE("What is no number is refused", "[existence]") {
  ExistenceModel model{Parameters{}};
  auto point = IcosahedralPoint::known(model);
  const auto nan = static_cast<float>(kNaN);
  for (const Eigen::Vector3f& bad :
       {Eigen::Vector3f(nan, 1.0F, 1.0F), Eigen::Vector3f(0.0F, 0.0F, 0.0F),
        Eigen::Vector3f(std::numeric_limits<float>::infinity(), 0.0F, 0.0F)}) {
    CHECK_THROWS_AS(point.hit(model, Look{bad}), std::invalid_argument);
    CHECK_THROWS_AS(point.miss(model, Look{bad}), std::invalid_argument);
    CHECK_THROWS_AS(IcosahedralPoint::born(model, Look{bad}), std::invalid_argument);
  }
  CHECK_THROWS_AS(model.elapsed(-1.0), std::invalid_argument);
  CHECK_THROWS_AS(model.elapsed(kNaN), std::invalid_argument);
  CHECK_THROWS_AS(point.multiply_odds(kNaN), std::invalid_argument);
  CHECK(point.probability() == Approx(0.99));

  for (double Parameters::*one :
       {&Parameters::prior, &Parameters::recall, &Parameters::visibility, &Parameters::false_rate,
        &Parameters::pass_recall, &Parameters::range_m, &Parameters::decay_per_s}) {
    Parameters parameters;
    parameters.*one = kNaN;
    CHECK_THROWS_AS(ExistenceModel(parameters), std::invalid_argument);
    parameters.*one = -1.0;
    CHECK_THROWS_AS(ExistenceModel(parameters), std::invalid_argument);
  }
}

TEMPLATE_TEST_CASE("A saved point goes on as if nothing had been", "[existence]", IcosahedralShell,
                   VonMisesFisherShell<6>) {
  using Point = PointExistence<TestType>;
  std::mt19937_64 random(4);
  std::bernoulli_distribution is_seen(0.6);
  ExistenceModel model{Parameters{}};
  auto point = Point::born(model, look_from_face(2));
  const auto look_on = [&](ExistenceModel& in, Point& at, std::uint64_t seed) {
    std::mt19937_64 own(seed);
    for (int i = 0; i < 300; ++i) {
      if (i % 50 == 0) in.begin_pass();
      const Look look{20.0F * test::random_direction(own)};
      if (is_seen(own))
        at.hit(in, look);
      else
        at.miss(in, look);
      at.elapse(in, in.elapsed(10.0));
    }
  };
  look_on(model, point, 5);
  PassHistories histories;
  point.tell(histories);
  model.learn(histories);
  const auto saved = point.save();
  const SavedModel of_model = model.save();
  ExistenceModel other{Parameters{}};
  other.load(of_model);
  auto loaded = Point::load(other, saved);
  look_on(model, point, 6);
  look_on(other, loaded, 6);
  CHECK(loaded.probability() == point.probability());
  const auto a = loaded.save();
  const auto b = point.save();
  CHECK(bytes_of(a) == bytes_of(b));
}

TEST_CASE("Damaged and foreign states are refused", "[existence]") {
  ExistenceModel model{Parameters{}};
  const auto good = IcosahedralPoint::known(model).save();
  auto bad = good;
  bad.version = 7;
  CHECK_THROWS_AS(IcosahedralPoint::load(model, bad), std::invalid_argument);
  bad = good;
  bad.odds = kNaN;
  CHECK_THROWS_AS(IcosahedralPoint::load(model, bad), std::invalid_argument);
  bad = good;
  bad.shell[3] = -1.0F;
  CHECK_THROWS_AS(IcosahedralPoint::load(model, bad), std::invalid_argument);
  bad = good;
  bad.numbers[0] = std::numeric_limits<float>::infinity();
  CHECK_THROWS_AS(IcosahedralPoint::load(model, bad), std::invalid_argument);
  for (const double limit : {0.0, 1e-300, 1e300}) {
    bad = good;
    bad.odds = limit;
    const double p = IcosahedralPoint::load(model, bad).probability();
    CHECK((p >= 1e-6 && p <= 1.0 - 1e-6 + 1e-12));
  }
  SavedModel saved = model.save();
  saved.recall[2] = kNaN;
  CHECK_THROWS_AS(model.load(saved), std::invalid_argument);
  for (const double wrong : {-0.1, 1.0, kNaN}) {
    saved = model.save();
    saved.learned[0] = wrong;
    CHECK_THROWS_AS(model.load(saved), std::invalid_argument);
  }
}

TEST_CASE("A point takes at most 256 bytes", "[existence]") {
  CHECK(sizeof(IcosahedralPoint) <= 256);
  CHECK(sizeof(PointExistence<VonMisesFisherShell<6>>) <= 256);
}
