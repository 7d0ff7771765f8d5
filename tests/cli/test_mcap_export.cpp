// `understory export --format mcap`; what is in the file is checked in tests/mcap and
// tests/foxglove.
#include "common/wire/convert.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "understory/log_t.hpp"

namespace understory::test {
namespace {

std::string small_log(const TemporaryDirectory& directory) {
  const std::string path = (directory / "run.lcm").string();
  io::LcmLogWriter writer(path);
  log_t line{};
  line.process = "ekf";
  line.text = "hello";
  writer.write(1000, "LOG", wire::encode_message(line));
  writer.write(2000, "LOG", std::vector<std::uint8_t>{1, 2, 3});
  writer.write(3000, "SOMETHING_ELSE", std::vector<std::uint8_t>{1});
  writer.commit();
  return path;
}

bool is_mcap(const std::filesystem::path& path) {
  const std::string text = read_text(path);
  return text.starts_with("\x89MCAP0\r\n") && text.ends_with("\x89MCAP0\r\n") &&
         text.find("foxglove.Log") != std::string::npos;
}

TEST_CASE("export: a log without a map becomes an MCAP file, in a directory or by name") {
  const TemporaryDirectory directory;
  const std::string log = small_log(directory);
  const std::string out = (directory / "out").string();
  const Outcome outcome =
      understory_command(directory, "export " + log + " --format mcap --out " + out);
  INFO(outcome.error);
  REQUIRE(outcome.status == 0);
  REQUIRE(outcome.out == out + "/run.mcap\n");
  REQUIRE(outcome.error.find("1 messages are not what their channel says") != std::string::npos);
  REQUIRE(is_mcap(directory / "out/run.mcap"));

  const std::string file = (directory / "other.mcap").string();
  REQUIRE(understory_command(directory, "export " + log + " --format mcap --out " + file).status ==
          0);
  REQUIRE(is_mcap(file));
}

TEST_CASE("export: an MCAP file that cannot be written, or of no log, is said in a line") {
  const TemporaryDirectory directory;
  const std::string log = small_log(directory);
  const std::string file = (directory / "out.mcap").string();
  const std::string with_file = " --format mcap,tum --out " + file;
  REQUIRE(understory_command(directory, "export " + log + with_file).status == 2);
  REQUIRE_FALSE(std::filesystem::exists(file));

  std::ofstream(directory / "text") << "this is not a log, whatever its name may be";
  const Outcome none = understory_command(
      directory, "export " + (directory / "text").string() + " --format mcap --out " + file);
  REQUIRE(none.status == 1);
  REQUIRE(lines(none.error) == 1);
  REQUIRE_FALSE(std::filesystem::exists(file));

  const Outcome blocked =
      understory_command(directory, "export " + log + " --format mcap --out " + log + "/x.mcap");
  REQUIRE(blocked.status == 1);
  REQUIRE(lines(blocked.error) == 1);
}

}  // namespace
}  // namespace understory::test
