// Passes on which something was measured in front of the point: what they missed counts for less.
#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>
#include <vector>

#include "common/existence/von_mises_fisher_shell.hpp"
#include "tests/catch.hpp"
#include "tests/existence/existence_scene.hpp"

using namespace understory;
using namespace understory::existence;
using test::IcosahedralPoint;
using test::look_from_face;

namespace {

/// A detector that is known to see nearly everything on a pass.
Parameters sharp_detector() {
  Parameters parameters = test::plain_parameters();
  parameters.pass_recall = 0.99;
  return parameters;
}

Look look(int face, Ray ray) {
  Look result = look_from_face(face);
  result.ray = ray;
  return result;
}

/// Rays of a pass, from left to right over four faces.
template <typename Point>
void pass_by(ExistenceModel& model, Point& point, const std::vector<Ray>& rays) {
  for (std::size_t i = 0; i < rays.size(); ++i)
    point.miss(model, look(static_cast<int>(4 * i / rays.size()), rays[i]));
}

/// As behind a stack of timber: the edges are unknown.
std::vector<Ray> hidden_rays() {
  std::vector<Ray> rays(10, Ray::kBlocked);
  rays[0] = rays[1] = rays[9] = Ray::kUnknown;
  return rays;
}

}  // namespace

TEST_CASE("What is hidden on pass after pass stays, though its edges are unknown", "[existence]") {
  ExistenceModel model(sharp_detector());
  auto hidden = IcosahedralPoint::known(model);
  auto in_the_open = hidden;
  for (int pass = 0; pass < 6; ++pass) {
    model.begin_pass();
    pass_by(model, hidden, hidden_rays());
    for (int i = 0; i < 3; ++i) in_the_open.miss(model, look(i, Ray::kUnknown));
  }
  CHECK(hidden.probability() > 0.98);
  // The same unknown looks without a return in front.
  CHECK(in_the_open.probability() < 1e-3);
}

TEST_CASE("A point that comes out from behind something is there after two hits more",
          "[existence]") {
  // Seen, hidden and unknown by turns, nearly from one side.
  const auto after = [](std::string_view looks) {
    ExistenceModel model(sharp_detector());
    auto point = IcosahedralPoint::known(model);
    model.begin_pass();
    point.enter_pass(model);
    point.multiply_odds(odds_of(0.6) / odds_of(point.probability()));
    for (const char one : looks) {
      if (one == 'h')
        point.hit(model, look(3, Ray::kUnknown));
      else
        point.miss(model, look(3, one == 'B' ? Ray::kBlocked : Ray::kUnknown));
    }
    return point.probability();
  };
  CHECK(after("uuuuBBBBu") < 0.5);
  CHECK(after("uuuuBBBBuhh") > 0.5);
  CHECK(after("uuuuBBBBuhhuh") > 0.9);
  // What is gone does not come back by a detection that is false, nor by two.
  CHECK(after("uuuuuuhuuuuuu") < 0.15);
  CHECK(after("uuuuuuhuuuhuuu") < 0.35);
}

TEST_CASE("What is gone is found where single things stood in front, as if there were none",
          "[existence]") {
  ExistenceModel model(sharp_detector());
  auto gone = IcosahedralPoint::known(model);
  auto without = gone;
  std::vector<Ray> rays(12, Ray::kUnknown);
  rays[3] = rays[7] = Ray::kBlocked;
  pass_by(model, gone, rays);
  rays[3] = rays[7] = Ray::kUnknown;
  pass_by(model, without, rays);
  CHECK(gone.probability() < 0.55);
  CHECK(gone.probability() < without.probability() + 0.05);

  // One look past the edge of the stack, and the place was free: as a pass that was not hidden.
  auto seen_through = IcosahedralPoint::known(model);
  rays = hidden_rays();
  rays[9] = Ray::kPassed;
  pass_by(model, seen_through, rays);
  auto as_before = IcosahedralPoint::known(model);
  std::erase(rays, Ray::kBlocked);
  as_before.miss(model, look(0, Ray::kUnknown));
  as_before.miss(model, look(0, Ray::kUnknown));
  as_before.miss(model, look(3, Ray::kPassed));
  CHECK(seen_through.probability() == Approx(as_before.probability()));
}

TEST_CASE("The looks of a pass count in any order, by Bayes' rule over a hidden pass",
          "[existence]") {
  std::mt19937_64 random(21);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int trial = 0; trial < 200; ++trial) {
    Parameters parameters = test::plain_parameters();
    parameters.pass_recall = 0.3 + 0.699 * unit(random);
    ExistenceModel model(parameters);
    std::vector<Ray> rays;
    PassOccluder occluder;
    const double share = unit(random);
    for (int i = 2 + static_cast<int>(10.0 * unit(random)); i > 0; --i) {
      rays.push_back(unit(random) < share ? Ray::kBlocked : Ray::kUnknown);
      occluder = occluder.after(rays.back());
    }
    auto point = IcosahedralPoint::known(model);
    for (const Ray ray : rays) point.miss(model, look(0, ray));
    std::ranges::shuffle(rays, random);
    auto other = IcosahedralPoint::known(model);
    for (const Ray ray : rays) other.miss(model, look(0, ray));
    REQUIRE(other.probability() == Approx(point.probability()).epsilon(1e-6));

    // Before any look a pass sees the point with v (1 - h), or does not with h + s (1 - v).
    const double hidden = static_cast<double>(occluder.chance()), v = parameters.pass_recall;
    const double seeing = v * (1.0 - hidden);
    const double all = seeing + hidden + occluder.stopped_itself() * (1.0 - v);
    parameters.pass_recall = seeing / all;
    ExistenceModel hidden_model(parameters);
    auto expected = IcosahedralPoint::known(hidden_model);
    expected.multiply_odds(all);
    for (const Ray ray : rays)
      if (ray == Ray::kUnknown) expected.miss(hidden_model, look(0, ray));
    REQUIRE(point.probability() == Approx(expected.probability()).epsilon(1e-3));
    REQUIRE(point.pass_visibility() == Approx(expected.pass_visibility()).margin(1e-3));
  }
}

TEST_CASE("Passes that were hidden teach little of the detector", "[existence]") {
  Parameters parameters;
  parameters.pass_recall = 0.9;
  const auto recall_after = [&](const std::vector<Ray>& rays) {
    ExistenceModel model(parameters);
    std::vector<IcosahedralPoint> points(50, IcosahedralPoint::known(model));
    for (int pass = 0; pass < 3; ++pass) {
      model.begin_pass();
      for (IcosahedralPoint& point : points) {
        if (pass == 1) {
          pass_by(model, point, rays);
        } else {
          for (int i = 0; i < 8; ++i) point.hit(model, look_from_face(i / 2));
        }
      }
    }
    model.begin_pass();
    for (IcosahedralPoint& point : points) point.enter_pass(model);
    return model.recall().of_pass();
  };
  CHECK(recall_after(hidden_rays()) > 0.92);
  CHECK(recall_after(std::vector<Ray>(10, Ray::kUnknown)) < 0.7);
}

TEST_CASE("A tree that is missed stops the beams, and what they pass has gone", "[existence]") {
  // Six years later: seen, missed behind its own bark, missed and too thin for the beams, felled.
  enum Kind { kSeen = 64, kThick = 82, kThin = 95, kAll = 100 };
  Parameters parameters;
  parameters.decay_per_s = 0.15 / (6.0 * 365.0 * 86400.0);
  parameters.decay_weight = 20.0;
  ExistenceModel model(parameters);
  std::vector<IcosahedralPoint> points(10 * kAll, IcosahedralPoint::known(model));
  model.learn({});
  model.begin_drive();
  const std::vector<Ray> thick(7, Ray::kBlocked), thin(7, Ray::kUnknown), felled(7, Ray::kPassed);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].elapse(model, model.elapsed(6.0 * 365.0 * 86400.0));
    points[i].enter_pass(model);
    const std::size_t kind = i % kAll;
    if (kind < kSeen)
      for (int k = 0; k < 7; ++k) points[i].hit(model, look_from_face(k / 2));
    else
      pass_by(model, points[i], kind < kThick ? thick : kind < kThin ? thin : felled);
  }
  PassHistories histories;
  for (const IcosahedralPoint& point : points) point.tell(histories);
  model.learn(histories);
  for (IcosahedralPoint& point : points) point.reconsider(model);

  CHECK(model.learned().now == Approx(0.67).margin(0.1));
  CHECK(points[kSeen].probability() > 0.9);
  CHECK(points[kThick].probability() > 0.5);
  CHECK(points[kThin].probability() < 0.05);
}

TEST_CASE("What was hidden on a drive that seemed to miss much stays when that turns out wrong",
          "[existence]") {
  // Half of what was in the open went in a month, so that the drive after it seems to miss half;
  // the later ones show that it did not. What stood behind something was never missed.
  enum Kind { kHiddenOnes = 30, kGone = 300, kAll = 600 };
  constexpr double kDay_s = 86400.0;
  Parameters parameters;
  parameters.decay_per_s = 1e-7;
  parameters.decay_weight = 2.0;
  ExistenceModel model(parameters);
  std::vector<IcosahedralPoint> points(kAll, IcosahedralPoint::known(model));
  const auto learn = [&] {
    PassHistories histories;
    for (const IcosahedralPoint& point : points) point.tell(histories);
    model.learn(histories);
    for (IcosahedralPoint& point : points) point.reconsider(model);
  };
  for (const double gap_s : {30.0 * kDay_s, kDay_s, kDay_s}) {
    learn();
    model.begin_drive();
    for (std::size_t i = 0; i < points.size(); ++i) {
      points[i].elapse(model, model.elapsed(gap_s));
      points[i].enter_pass(model);
      if (i < kGone)
        pass_by(model, points[i],
                i < kHiddenOnes ? hidden_rays() : std::vector<Ray>(10, Ray::kUnknown));
      else
        for (int face = 0; face < 4; ++face) points[i].hit(model, look(face, Ray::kUnknown));
    }
    learn();
  }
  CHECK(model.learned().now > 0.9);
  CHECK(points[0].probability() > 0.5);
  CHECK(points[kHiddenOnes].probability() < 0.1);
}

TEST_CASE("What a hidden pass missed follows v as its returns say, up to a factor of 1.35",
          "[existence]") {
  // Not as (1 - v) to some power, which would go to no end.
  for (int blocked = 1; blocked <= 10; ++blocked) {
    for (int unknown = 0; unknown <= 10; ++unknown) {
      PassOccluder occluder;
      for (int i = 0; i < std::max(blocked, unknown); ++i) {
        if (i < blocked) occluder = occluder.after(Ray::kBlocked);
        if (i < unknown) occluder = occluder.after(Ray::kUnknown);
      }
      if (!occluder.is_hidden_pass()) continue;
      CAPTURE(blocked, unknown, occluder.chance());
      const auto exact = [&](double missed_share) {
        return occluder.chance() + occluder.stopped_itself() * missed_share;
      };
      for (const double was : {0.5, 0.26, 0.05}) {
        for (const double is : {0.36, 0.02, 0.001}) {
          const double ratio = PassOccluder::missed_when_hidden(is) /
                               PassOccluder::missed_when_hidden(was) * exact(was) / exact(is);
          CHECK(std::abs(std::log(ratio)) < std::log(1.35));
        }
      }
    }
  }
}

TEST_CASE("Hidden passes are saved, and states that have none apart are read", "[existence]") {
  ExistenceModel model(sharp_detector());
  auto point = IcosahedralPoint::known(model);
  for (int pass = 0; pass < 12; ++pass) {
    model.begin_pass();
    if (pass % 2 == 0)
      pass_by(model, point, hidden_rays());
    else
      pass_by(model, point, std::vector<Ray>(4, Ray::kUnknown));
    const auto loaded = IcosahedralPoint::load(model, point.save());
    CHECK(loaded.save().numbers == point.save().numbers);
  }
  auto older = point.save();
  older.version = 3;
  CHECK(IcosahedralPoint::load(model, older).probability() == point.probability());
}

TEST_CASE("A hidden pass is saved and goes on, and points of an older version are read",
          "[existence]") {
  ExistenceModel model(sharp_detector());
  for (int pass = 0; pass < 3; ++pass) model.begin_pass();
  auto point = IcosahedralPoint::known(model);
  std::vector<Ray> rays = hidden_rays();
  pass_by(model, point, {rays.begin(), rays.begin() + 5});
  auto loaded = IcosahedralPoint::load(model, point.save());
  for (auto* one : {&point, &loaded}) pass_by(model, *one, {rays.begin() + 5, rays.end()});
  const auto a = point.save(), b = loaded.save();
  CHECK(std::memcmp(&a, &b, sizeof a) == 0);

  // Version 1: 32 bits of the pass, 1 - v in 32 steps per octave, nothing of rays.
  auto plain = IcosahedralPoint::known(model);
  plain.miss(model, look(1, Ray::kUnknown));
  auto older = plain.save();
  older.version = 1;
  older.pass[0] = model.pass();
  older.pass[2] = (older.pass[2] & 0xFFFFFFU) | (213U << 24U);  // 0.0099
  auto from_older = IcosahedralPoint::load(model, older);
  for (auto* one : {&plain, &from_older}) pass_by(model, *one, rays);
  CHECK(from_older.probability() == Approx(plain.probability()).epsilon(0.02));
  older.version = 5;
  CHECK_THROWS_AS(IcosahedralPoint::load(model, older), std::invalid_argument);
}

TEST_CASE("However many looks a pass has, their ratio says whether it is hidden", "[existence]") {
  const auto chance = [](int blocked, int unknown) {
    PassOccluder occluder;
    for (int i = 0; i < std::max(blocked, unknown); ++i) {
      if (i < blocked) occluder = occluder.after(Ray::kBlocked);
      if (i < unknown) occluder = occluder.after(Ray::kUnknown);
    }
    return occluder.chance();
  };
  CHECK(chance(0, 0) == 0.0F);
  CHECK(chance(0, 1000) == 0.0F);
  CHECK(chance(1000, 0) > 0.9F);
  CHECK(chance(1000, 300) > 0.9F);
  CHECK(chance(100, 1000) < 0.1F);
  CHECK(PassOccluder::refuted().after(Ray::kBlocked).chance() == 0.0F);
  for (unsigned code = 0; code < 256; ++code) {
    PassOccluder occluder = PassOccluder::of(static_cast<std::uint8_t>(code));
    for (const Ray ray : {Ray::kBlocked, Ray::kUnknown}) {
      CHECK(occluder.after(ray).chance() >= 0.0F);
      CHECK(occluder.after(ray).chance() < 1.0F);
    }
  }
}

TEST_CASE("The other shell keeps what is hidden, too", "[existence]") {
  ExistenceModel model(sharp_detector());
  auto hidden = PointExistence<VonMisesFisherShell<6>>::known(model);
  for (int pass = 0; pass < 6; ++pass) {
    model.begin_pass();
    pass_by(model, hidden, hidden_rays());
  }
  CHECK(hidden.probability() > 0.98);
}
