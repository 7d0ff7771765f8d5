#include "deploy/cli/import_bag_mounts.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>

#include "common/io/data_error.hpp"
#include "common/io/number_reader.hpp"
#include "common/io/text_file.hpp"
#include "deploy/cli/paths.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

constexpr double kNothing = 5e-7;

Eigen::Isometry3d stated_mount(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string wanted =
      fmt::format("--mount {}: FRAME=x,y,z[,roll,pitch,yaw] is wanted", text);
  if (equals == std::string::npos || equals == 0) throw io::DataError(wanted);
  std::vector<double> numbers;
  const std::string list = text.substr(equals + 1);
  io::NumberReader reader(list, "--mount " + text);
  while (const auto number = reader.next()) numbers.push_back(*number);
  if (numbers.size() != 3 && numbers.size() != 6) throw io::DataError(wanted);

  numbers.resize(6, 0.0);
  Eigen::Isometry3d mount = Eigen::Isometry3d::Identity();
  mount.translation() = Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
  mount.linear() = (Eigen::AngleAxisd(numbers[5], Eigen::Vector3d::UnitZ()) *
                    Eigen::AngleAxisd(numbers[4], Eigen::Vector3d::UnitY()) *
                    Eigen::AngleAxisd(numbers[3], Eigen::Vector3d::UnitX()))
                       .toRotationMatrix();
  return mount;
}

/// Keys of one mount, without those that are zero.
std::string mount_text(const std::string& table, const Eigen::Isometry3d& mount) {
  const Eigen::Matrix3d& r = mount.linear();
  const Eigen::Vector3d& p = mount.translation();
  const std::pair<const char*, double> keys[] = {
      {"x_m", p.x()},
      {"y_m", p.y()},
      {"z_m", p.z()},
      {"roll_rad", std::atan2(r(2, 1), r(2, 2))},
      {"pitch_rad", std::asin(std::clamp(-r(2, 0), -1.0, 1.0))},
      {"yaw_rad", std::atan2(r(1, 0), r(0, 0))}};
  std::string text = fmt::format("[{}]\n", table);
  for (const auto& [key, value] : keys) {
    if (std::abs(value) > kNothing) text += fmt::format("{} = {:.6f}\n", key, value);
  }
  return text;
}

/// A mount or why there is none.
std::string mount_of(const std::string& table, const std::string& frame, const BagMounts& mounts,
                     std::vector<std::string>& remarks) {
  const auto mount = mounts.find(frame);
  if (mount)
    return fmt::format("# {} on {}\n", frame, mounts.base()) + mount_text(table, *mount) + "\n";
  remarks.push_back(mounts.missing(frame));
  return fmt::format("# Not known: {} on the vehicle.\n[{}]\nx_m = 0.0\n\n", frame, table);
}

}  // namespace

BagMounts::BagMounts(bag::StaticTransforms transforms, const std::string& base,
                     const std::vector<std::string>& stated)
    : transforms_(std::move(transforms)), base_(base) {
  for (const char* usual : {"base_link", "base_footprint"}) {
    if (base_.empty() && transforms_.has(usual)) base_ = usual;
  }
  if (base_.empty()) base_ = "base_link";
  for (const std::string& text : stated)
    stated_[text.substr(0, text.find('='))] = stated_mount(text);
}

void BagMounts::require_known(const bag::Survey& survey) const {
  std::set<std::string> known;
  for (const std::string& frame : transforms_.frames()) known.insert(frame);
  for (const bag::TopicSurvey& topic : survey.topics) known.insert(topic.frame);
  known.erase("");
  for (const auto& [frame, mount] : stated_) {
    if (!known.contains(frame))
      throw io::DataError(
          fmt::format("--mount {}: no such frame; the bag has {}", frame, fmt::join(known, ", ")));
  }
}

std::optional<Eigen::Isometry3d> BagMounts::find(const std::string& frame) const {
  if (const auto own = stated_.find(frame); own != stated_.end()) return own->second;
  if (frame == base_) return Eigen::Isometry3d::Identity();
  return transforms_.find(base_, frame);
}

std::string BagMounts::missing(const std::string& frame) const {
  std::string known;
  for (const std::string& name : transforms_.frames()) known += (known.empty() ? "" : ", ") + name;
  return fmt::format(
      "no static transform joins {} and {} (frames: {}): state it with --mount "
      "{}=x,y,z,roll,pitch,yaw, "
      "or name the vehicle's frame with --base",
      base_, frame.empty() ? "''" : frame, known.empty() ? "none" : known, frame);
}

std::string bag_settings(const bag::Bag& bag, const bag::Survey& survey, const BagChoice& choice,
                         const BagMounts& mounts, const BagFindings& findings,
                         std::vector<std::string>& remarks) {
  const auto frame = [&](std::size_t topic) { return survey.topics[topic].frame; };
  std::string text =
      "# Where the sensors of the bag sit. The vehicle's origin should be on the ground below the\n"
      "# rear axle. Nothing of the base.\nbase = \"\"\n\n";

  if (choice.imu) {
    const double rate_hz = survey.topics[*choice.imu].rate_hz();
    if (rate_hz > 0.0 && rate_hz < 20.0)
      text += fmt::format("[imu]\nmax_gap_s = {:.2f}\n\n", 3.0 / rate_hz);
    text += mount_of("imu.mount", frame(*choice.imu), mounts, remarks);
  }

  if (choice.scan) text += mount_of("planar.mount", frame(*choice.scan), mounts, remarks);
  if (choice.cloud) {
    const double rate_hz = survey.topics[*choice.cloud].rate_hz();
    if (!findings.has_times) {
      text += fmt::format(
          "[lidar]\n# The cloud has no times of points; the sense of rotation is seen from above.\n"
          "times_from_azimuth = \"clockwise\"\nrevolution_s = {:.4f}\n\n",
          rate_hz > 0.0 ? 1.0 / rate_hz : 0.1);
      remarks.push_back(
          fmt::format("{} has no times of points: lidar.times_from_azimuth makes them "
                      "(clockwise; state it otherwise in the settings)",
                      bag.topics()[*choice.cloud].name));
    }
    if (!findings.has_rings)
      remarks.push_back(fmt::format("{} has no rings: trunks and corners are not found in it",
                                    bag.topics()[*choice.cloud].name));
    text += mount_of("lidar.mount", frame(*choice.cloud), mounts, remarks);
  }

  if (choice.odometry)
    text += fmt::format("[wheels]\nwheelbase_m = {:.4f}\nencoder_left_m = 0.0\n\n",
                        findings.wheelbase_m);
  text += fmt::format("[expected]\nimu = {}\nwheels = {}\nsweep = {}\nscan = {}\n",
                      choice.imu.has_value(), choice.odometry.has_value(), choice.cloud.has_value(),
                      choice.scan.has_value());
  return text;
}

void write_bag_config(const std::string& folder, const std::string& settings) {
  const std::filesystem::path path(folder);
  const auto base = std::filesystem::absolute(default_config_directory()) / "lidar";
  const std::array<std::pair<std::filesystem::path, std::string>, 2> files{
      {{path / "launch.toml", fmt::format("base = \"{}\"\n", base.lexically_normal().string())},
       {path / "lidar_imu_input.toml", settings}}};

  // What a person edited stays.
  for (const auto& [file, text] : files) {
    if (std::filesystem::exists(file) && io::read_whole_file(file.string()) != text)
      throw io::DataError(fmt::format(
          "--config: {} is there already and reads otherwise: name another folder", file.string()));
  }
  std::filesystem::create_directories(path);
  for (const auto& [file, text] : files) write_text_file(file, text);
}

}  // namespace understory::cli
