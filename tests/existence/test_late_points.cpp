// Points that follow what was learned when they are needed.
#include <random>
#include <vector>

#include "common/existence/icosahedral_shell.hpp"
#include "common/existence/point.hpp"
#include "tests/catch.hpp"
#include "tests/existence/existence_scene.hpp"

using namespace understory;
using namespace understory::existence;
using test::IcosahedralPoint;
using test::look_from_face;

TEST_CASE("P that left out some sums of all histories follows as if it had had each",
          "[existence]") {
  std::mt19937_64 random(77);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Parameters parameters;
  parameters.decay_per_s = 2e-8;
  parameters.decay_weight = 2.0;
  ExistenceModel each_model(parameters), late_model(parameters);
  std::vector<IcosahedralPoint> each(200, IcosahedralPoint::known(each_model));
  std::vector<IcosahedralPoint> late(200, IcosahedralPoint::known(late_model));
  std::vector<double> followed(late.size(), 0.0);

  const auto follow = [&](std::size_t i) {
    late[i].reconsider(late_model, followed[i]);
    followed[i] = late_model.learned().before;
  };
  const auto learn = [&] {
    PassHistories of_each, of_late;
    for (const IcosahedralPoint& one : each) one.tell(of_each);
    for (const IcosahedralPoint& one : late) one.tell(of_late);
    each_model.learn(of_each);
    late_model.learn(of_late);
    for (IcosahedralPoint& one : each) one.reconsider(each_model);
  };
  for (int drive = 0; drive < 4; ++drive) {
    if (drive > 0) {
      for (std::size_t i = 0; i < late.size(); ++i) follow(i);
      each_model.begin_drive();
      late_model.begin_drive();
      for (std::size_t i = 0; i < late.size(); ++i) {
        each[i].elapse(each_model, each_model.elapsed(30.0 * 86400.0));
        late[i].elapse(late_model, late_model.elapsed(30.0 * 86400.0));
        each[i].enter_pass(each_model);
        late[i].enter_pass(late_model);
      }
      learn();
    }
    // A stretch of points after the other, and a sum after each; some wait for many of them.
    for (std::size_t i = 0; i < late.size(); ++i) {
      const bool is_missed = unit(random) < 0.4;
      if (drive > 0) follow(i);
      for (int look = 0; look < 4; ++look) {
        const bool is_seen = !is_missed && unit(random) < 0.8;
        const Look from = look_from_face((static_cast<int>(i) + look) % kFaces);
        is_seen ? each[i].hit(each_model, from) : each[i].miss(each_model, from);
        is_seen ? late[i].hit(late_model, from) : late[i].miss(late_model, from);
      }
      if (i % 20 == 19) learn();
    }
  }
  for (std::size_t i = 0; i < late.size(); ++i) {
    follow(i);
    CAPTURE(i);
    CHECK(late[i].probability() == Approx(each[i].probability()).margin(1e-3));
  }
  CHECK(late_model.learned().now == Approx(each_model.learned().now).margin(1e-4));
}
