// A folder of stem frames through the command: the log, its noise, and one line for each fault.
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "common/io/stem_frames.hpp"
#include "common/wire/convert.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "understory/ground_truth_t.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

/// 400 frames, 3 m and 2.5 s apart on a circle, pitched by 0.2 rad; one stem ahead.
std::vector<model::StemFrame> circling_frames() {
  std::vector<model::StemFrame> frames(400);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double angle = 0.05 * static_cast<double>(i);
    frames[i].utime = 1'000'000 + static_cast<model::Utime>(i) * 2'500'000;
    frames[i].world_T_sensor.linear() = (Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) *
                                         Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()))
                                            .toRotationMatrix();
    frames[i].world_T_sensor.translation() << 60.0 * std::sin(angle), -60.0 * std::cos(angle), 5.0;
    model::Stem stem;
    stem.position_m =
        frames[i].world_T_sensor.linear().transpose() *
        (Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * Eigen::Vector3d(8.0, 1.0, -1.0));
    stem.axis = Eigen::Vector3d::UnitZ();
    stem.diameter_m = 0.3;
    frames[i].stems = {stem};
  }
  return frames;
}

template <class T>
std::vector<T> in_log(const std::filesystem::path& file, const std::string& channel) {
  io::LcmLogReader reader(file);
  std::vector<T> found;
  for (const auto& event : read_log(reader)) {
    if (event.channel != channel) continue;
    auto message = wire::decode_message<T>(event.data);
    REQUIRE(message);
    found.push_back(std::move(*message));
  }
  return found;
}

struct ImportFixture {
  TemporaryDirectory directory;
  std::filesystem::path folder = directory / "drive";
  std::filesystem::path log = directory / "drive.lcm";

  ImportFixture() { io::write_stem_frames(folder, circling_frames()); }
  Outcome import(const std::string& more = "") {
    return understory_command(
        directory, "import stem-frames " + folder.string() + " --out " + log.string() + " " + more);
  }
};

}  // namespace

TEST_CASE("Stem frames become truth, levelled landmarks and odometry", "[import]") {
  ImportFixture fixture;
  const Outcome outcome = fixture.import("--sigma-m 0.07");
  CAPTURE(outcome.error);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("400 frames, 400 stems"));

  const auto truths = in_log<ground_truth_t>(fixture.log, "GROUND_TRUTH");
  const auto scans = in_log<model::LandmarkScan>(fixture.log, "LANDMARKS");
  const auto motions = in_log<model::Odometry>(fixture.log, "ODOMETRY");
  REQUIRE(truths.size() == 400);
  REQUIRE(scans.size() == 400);
  REQUIRE(motions.size() == 399);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    CHECK(truths[i].utime == scans[i].utime);
    CHECK(scans[i].sequence == i);
    const auto& stem = scans[i].detections.at(0);
    CHECK((stem.position_m - Eigen::Vector3d(8.0, 1.0, -1.0)).norm() < 1e-3);
    CHECK(stem.covariance_m2(1, 1) == Approx(0.0049));
    CHECK(stem.radius_m == Approx(0.15));
  }
}

TEST_CASE("The odometry of stem frames has the noise that was asked for", "[import]") {
  ImportFixture fixture;
  REQUIRE(fixture.import("--odometry-percent 2 --odometry-deg 0.5 --seed 3").status == 0);
  const auto noisy = in_log<model::Odometry>(fixture.log, "ODOMETRY");
  const Bytes first = read_bytes(fixture.log);
  REQUIRE(fixture.import("--odometry-percent 2 --odometry-deg 0.5 --seed 3").status == 0);
  CHECK(read_bytes(fixture.log) == first);
  REQUIRE(fixture.import("--odometry-percent 2 --odometry-deg 0.5 --seed 4").status == 0);
  CHECK_FALSE(read_bytes(fixture.log) == first);
  REQUIRE(fixture.import("--odometry-percent 0 --odometry-deg 0").status == 0);
  const auto exact = in_log<model::Odometry>(fixture.log, "ODOMETRY");
  REQUIRE(exact.size() == noisy.size());

  // Whitened by what the messages state, the errors are a chi-squared of 3 x 399 degrees of
  // freedom.
  double squared = 0.0;
  for (std::size_t i = 0; i < noisy.size(); ++i) {
    const Eigen::Vector3d error = (exact[i].from_T_to.inverse() * noisy[i].from_T_to).Log();
    squared += error.cwiseAbs2().cwiseQuotient(noisy[i].covariance.diagonal()).sum();
    const double step = exact[i].from_T_to.translation().norm();
    CHECK(std::sqrt(noisy[i].covariance(0, 0)) == Approx(0.02 * step).epsilon(1e-3));
    CHECK(std::sqrt(noisy[i].covariance(2, 2)) == Approx(0.5 * M_PI / 180.0).epsilon(1e-6));
  }
  CHECK(squared == Approx(3.0 * 399.0).margin(4.0 * std::sqrt(2.0 * 3.0 * 399.0)));
}

TEST_CASE("What is wrong with stem frames is one line on stderr, and no log", "[import]") {
  ImportFixture fixture;
  const auto refuse = [&](const std::string& says) {
    const Outcome outcome = fixture.import();
    CHECK(outcome.status == 1);
    CHECK(lines(outcome.error) == 1);
    CHECK_THAT(outcome.error, Contains(says));
    CHECK_FALSE(std::filesystem::exists(fixture.log));
  };
  SECTION("a frame less than poses") {
    std::filesystem::remove(fixture.folder / "frame_399.csv");
    refuse("trajectory.txt: 400 poses for 399 frames");
  }
  SECTION("a damaged number") {
    std::ofstream(fixture.folder / "frame_17.csv") << "x_m,y_m\n1,2\n3,nan\n";
    refuse("frame_17.csv, line 3: y_m 'nan' is no finite number");
  }
  SECTION("an empty frame file") {
    std::ofstream(fixture.folder / "frame_17.csv").flush();
    refuse("frame_17.csv: no heading");
  }
  SECTION("an empty folder") {
    std::filesystem::remove_all(fixture.folder);
    std::filesystem::create_directory(fixture.folder);
    refuse("no frame_<n>.csv in the folder");
  }
}

TEST_CASE("A simulated drive of stem frames is imported and scored", "[import]") {
  const TemporaryDirectory directory;
  std::ofstream map(directory / "stems.csv");
  map << "x_m,y_m,dbh_m\n";
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(0.0, 120.0);
  for (int i = 0; i < 350; ++i) {
    const double x = place(random);
    map << x << ',' << place(random) << ",0.3\n";
  }
  map.close();

  const std::string drive = (directory / "drive").string();
  const Outcome made =
      understory_command(directory, "sim stem-frames " + (directory / "stems.csv").string() +
                                        " --out " + drive + " --length 300 --seed 2");
  CAPTURE(made.error);
  REQUIRE(made.status == 0);
  CHECK(io::read_stem_frames(drive).size() > 100);
  CHECK(understory_command(directory, "import stem-frames " + drive + " --out " +
                                          (directory / "drive.lcm").string())
            .status == 0);
  const Outcome scored = understory_command(
      directory, "eval place-recognition " + drive + " --json " + (directory / "s.json").string());
  REQUIRE(scored.status == 0);
  const std::string json = read_text(directory / "s.json");
  for (const char* key :
       {R"("queries")", R"("recall_at_1")", R"("max_f1")", R"("recall_zero_wrong")",
        R"("wrong_accepted")", R"("error_m_p50")", R"("stem_residual_m_p50")",
        R"("with_diameters")", R"("ms_p50")", R"("bytes_per_frame")"})
    CHECK_THAT(json, Contains(key));

  // The same log through its stages: `eval recording` takes what the configuration's stages take.
  const std::string recording = "eval recording " + (directory / "drive.lcm").string() +
                                " --no-plots --json " + (directory / "r.json").string() +
                                " --config " UNDERSTORY_SOURCE_CONFIG;
  REQUIRE(understory_command(directory, recording + "/stem_frames").status == 0);
  std::map<std::string, nlohmann::json> rows;
  const auto document = nlohmann::json::parse(read_text(directory / "r.json"));
  for (const auto& row : document.at("rows")) rows[row["what"]] = row["value"];
  CHECK(rows.at("keyframes offered").get<double>() > 100);
  CHECK(rows.at("driven").get<double>() > 250);
  CHECK_FALSE(rows.contains("EKF_POSE ATE"));
  const Outcome other = understory_command(directory, recording + "/lidar");
  CHECK(other.status == 1);
  CHECK_THAT(other.error, Contains("no channel of it is an input of the stages of") &&
                              Contains("GROUND_TRUTH LANDMARKS"));

  const Outcome again = understory_command(
      directory, "sim stem-frames " + (directory / "stems.csv").string() + " --out " + drive);
  CHECK(again.status == 1);
  CHECK_THAT(again.error, Contains("has frames already"));
  CHECK(understory_command(directory, "sim").status == 2);

  std::ofstream(directory / "census.csv") << "x_m,y_m,dbh\n1,2,30\n3,4,\n5,6,thick\n";
  const std::string census = "sim stem-frames " + (directory / "census.csv").string() + " --out " +
                             (directory / "other").string();
  const Outcome unknown = understory_command(directory, census + " --dbh-cm girth");
  CHECK(unknown.status == 1);
  CHECK_THAT(unknown.error, Contains("census.csv: no column girth"));
  const Outcome damaged = understory_command(directory, census + " --dbh-cm dbh");
  CHECK(damaged.status == 1);
  CHECK_THAT(damaged.error, Contains("census.csv, line 4: dbh 'thick' is no number"));
}
