// Whose packets are taken, and when silence is reported.
#include "services/lidar_driver/sensor_watch.hpp"
#include "services/lidar_driver/udp_socket.hpp"
#include "tests/catch.hpp"

using namespace understory::lidar_driver;

TEST_CASE("the first sensor is kept until it is silent, a fixed one for ever", "[lidar_driver]") {
  const std::uint32_t one = *parse_ipv4("192.168.1.201");
  const std::uint32_t other = *parse_ipv4("192.168.1.202");
  for (const bool is_fixed : {false, true}) {
    SenderFilter filter;
    filter.fix(is_fixed ? "192.168.1.201" : "");
    CHECK(filter.admits(one));
    filter.set_sensor(one);
    CHECK_FALSE(filter.admits(other));
    filter.forget();
    CHECK(filter.admits(other) != is_fixed);
    CHECK(filter.refused() == (is_fixed ? 2U : 1U));
  }
}

TEST_CASE("silence is reported at once, then every second, until a packet comes",
          "[lidar_driver]") {
  using Due = SilenceWatch::Due;
  SilenceWatch watch;
  watch.set_silence_s(0.3);
  watch.start(0);
  CHECK(watch.look(200'000) == Due::kNothing);
  CHECK(watch.look(300'000) == Due::kReportSilence);
  CHECK(watch.look(400'000) == Due::kNothing);
  CHECK(watch.look(1'300'000) == Due::kReportSilence);
  CHECK(watch.silent_s(1'300'000) == Approx(1.3));
  CHECK(watch.hear(1'400'000));
  CHECK_FALSE(watch.hear(2'250'000));
  CHECK(watch.look(2'290'000) == Due::kNothing);
  CHECK(watch.look(2'300'000) == Due::kCheckClock);
  CHECK(watch.look(2'400'000) == Due::kNothing);
}
