// `launch` on a bus that it cannot hear.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>

#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

/// A UDP port that this process has and does not share.
class TakenPort {
 public:
  TakenPort() : file_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    REQUIRE(::bind(file_, reinterpret_cast<sockaddr*>(&any), sizeof(any)) == 0);
    socklen_t size = sizeof(any);
    REQUIRE(::getsockname(file_, reinterpret_cast<sockaddr*>(&any), &size) == 0);
    number_ = ntohs(any.sin_port);
  }
  ~TakenPort() { ::close(file_); }
  TakenPort(const TakenPort&) = delete;
  TakenPort& operator=(const TakenPort&) = delete;
  int number() const { return number_; }

 private:
  int file_;
  int number_ = 0;
};

}  // namespace

TEST_CASE("launch --fresh on a port that another program has deletes nothing", "[cli]") {
  const TakenPort port;
  const test::TemporaryDirectory directory;
  const auto kept = directory.path() / "state" / "keyframer" / "snapshot";
  std::filesystem::create_directories(kept.parent_path());
  std::ofstream(kept) << "the map";

  const auto outcome = understory_command(
      directory, "launch --fresh --config " UNDERSTORY_SOURCE_CONFIG
                 " --only keyframer "
                 "--state-dir " +
                     (directory / "state").string() + " --lcm-url '" +
                     "udpm://239.255.76.67:" + std::to_string(port.number()) + "?ttl=0'");
  CAPTURE(outcome.error);
  CHECK(outcome.status == 1);
  CHECK_THAT(outcome.error, Contains("is taken by `test_cli`"));
  CHECK(test::read_text(kept) == "the map");
}
