#include "deploy/cli/import_bag.hpp"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "common/io/data_error.hpp"
#include "common/io/text_file.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/printable.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/guarded_import.hpp"
#include "deploy/cli/import_bag_list.hpp"
#include "deploy/cli/import_bag_messages.hpp"
#include "deploy/cli/import_bag_mounts.hpp"
#include "deploy/cli/import_cloud.hpp"

namespace understory::cli {
namespace {

struct BagImportOptions {
  std::string path;
  std::string out;
  bool is_list = false;
  BagTopics topics;
  std::string base;
  std::vector<std::string> mounts;
  std::string config;
  std::vector<std::string> receive_time;
  BagConversion conversion;
};

std::uint64_t messages_in(const bag::Bag& bag, const std::vector<std::size_t>& topics) {
  std::uint64_t sum = 0;
  for (const std::size_t topic : topics) sum += bag.topics()[topic].messages.value_or(0);
  return sum;
}

bag::Survey survey_bag(bag::Bag& bag, const bag::CloudOptions& cloud) {
  std::vector<std::size_t> read;
  for (std::size_t i = 0; i < bag.topics().size(); ++i) {
    if (role_of(bag.topics()[i]) != bag::Role::kNone) read.push_back(i);
  }
  terminal::Progress progress("looking through the bag",
                              static_cast<double>(messages_in(bag, read)));
  return survey(bag, cloud, [&](std::uint64_t count) {
    terminal::throw_if_interrupted();
    progress.update(static_cast<double>(count));
  });
}

std::set<std::size_t> topics_named(const bag::Bag& bag, const std::vector<std::string>& names) {
  std::set<std::size_t> found;
  for (const std::string& name : names) {
    const std::size_t before = found.size();
    for (std::size_t i = 0; i < bag.topics().size(); ++i) {
      if (bag.topics()[i].name == name) found.insert(i);
    }
    if (found.size() == before)
      throw io::DataError(fmt::format("--receive-time {}: no such topic", name));
  }
  return found;
}

void say(const std::vector<std::string>& lines) {
  for (const std::string& line : lines)
    fmt::print(stderr, "import bag: {}\n", terminal::printable(line));
}

void read_all(bag::Bag& bag, const BagChoice& choice, BagMessages& messages) {
  const std::vector<std::size_t> wanted = choice.all();
  terminal::Progress progress("importing", static_cast<double>(messages_in(bag, wanted)));
  bag.rewind(wanted);
  while (const auto message = bag.next()) {
    terminal::throw_if_interrupted();
    messages.take(*message);
    progress.advance();
  }
  messages.finish();
}

void report(const BagImportOptions& options, const BagLog& log, const std::string& cloud) {
  if (!cloud.empty()) fmt::print("{}\n", terminal::printable(cloud));
  fmt::print(
      "{} sweeps, {} scans, {} IMU samples, {} wheel samples, {} fixes, {} true poses -> {}\n",
      log.sweeps(), log.count("RAW_SCAN"), log.count("RAW_IMU"), log.count("RAW_WHEELS"),
      log.count("RAW_GNSS"), log.count("GROUND_TRUTH"), options.out);
}

void write_settings(const BagImportOptions& options, const std::string& settings) {
  if (options.config.empty()) {
    fmt::print("\nSettings of this bag (--config FOLDER writes them), lidar_imu_input.toml:\n{}",
               settings);
    return;
  }
  write_bag_config(options.config, settings);
  fmt::print("understory replay {} --config {}\n", options.out, options.config);
}

/// What a laser's packets need beside them: the file that is named, or, of an Ouster, the text that
/// its driver put into the bag.
void describe_laser(bag::Bag& bag, packets::SensorDescription& laser) {
  if (!laser.source.empty()) {
    laser.description = io::read_whole_file(laser.source);
    return;
  }
  for (std::size_t i = 0; i < bag.topics().size(); ++i) {
    const bag::Topic& topic = bag.topics()[i];
    if (topic.type != "std_msgs/String" || !topic.name.ends_with("metadata")) continue;
    bag.rewind({i});
    if (const auto message = bag.next()) {
      bag::MessageReader reader = reader_of(bag, *message);
      laser.description = reader.text();
      laser.source = topic.name;
    }
    return;
  }
}

bool has_packets(const bag::Bag& bag, const std::optional<std::size_t>& topic) {
  return topic && bag::is_packet_type(bag.topics()[*topic].type);
}

/// What is wrong with the transforms, by which mounts may be missing.
std::vector<std::string> transform_remarks(const bag::Bag& bag, const bag::Survey& survey) {
  std::vector<std::string> lines = survey.transforms.remarks();
  for (std::size_t i = 0; i < bag.topics().size(); ++i) {
    const bag::Topic& topic = bag.topics()[i];
    if (role_of(topic) == bag::Role::kTransforms && !survey.topics[i].fault.empty())
      lines.push_back(fmt::format("{}: {}", topic.name, survey.topics[i].fault));
  }
  return lines;
}

void import_chosen(const BagImportOptions& options, bag::Bag& bag, const bag::Survey& survey,
                   const BagMounts& mounts) {
  const BagChoice choice = choose_bag_topics(bag.topics(), options.topics);
  if (choice.all().empty())
    throw io::DataError("nothing that can be imported; --list shows what there is");
  BagConversion conversion = options.conversion;
  if (conversion.cloud.max_range_m != bag::CloudOptions{}.max_range_m)
    conversion.laser.max_range_m = conversion.cloud.max_range_m;
  if (has_packets(bag, choice.cloud) || has_packets(bag, choice.imu))
    describe_laser(bag, conversion.laser);
  conversion.by_reception = topics_named(bag, options.receive_time);
  std::vector<std::string> remarks = bag.remarks();
  remarks.insert(remarks.end(), choice.remarks.begin(), choice.remarks.end());
  for (std::string& line : transform_remarks(bag, survey)) remarks.push_back(std::move(line));
  std::vector<std::size_t> by_stamp;
  for (const std::size_t topic : choice.all()) {
    if (!conversion.by_reception.contains(topic)) by_stamp.push_back(topic);
  }
  for (std::string& line : clock_remarks(bag, survey, by_stamp)) remarks.push_back(std::move(line));

  BagLog log(options.out);
  BagMessages messages(bag, survey, choice, mounts, conversion, log);
  read_all(bag, choice, messages);
  if (choice.cloud && log.sweeps() == 0)
    throw io::DataError(fmt::format("{}: not one sweep ({})", bag.topics()[*choice.cloud].name,
                                    messages.cloud_text()));
  const BagFindings findings{messages.has_times(), messages.has_rings(), conversion.wheelbase_m};
  const std::string settings = bag_settings(bag, survey, choice, mounts, findings, remarks);
  log.commit();

  for (std::string& line : messages.remarks()) remarks.push_back(std::move(line));
  say(remarks);
  report(options, log, messages.cloud_text());
  write_settings(options, settings);
}

void import_bag(const BagImportOptions& options) {
  if (options.is_list == !options.out.empty())
    wrong_usage("import bag: either --list or --out RUN.lcm");
  refuse_to_overwrite(options.path, options.out);

  const auto bag = bag::open_bag(options.path);
  try {
    const bag::Survey found = survey_bag(*bag, options.conversion.cloud);
    const BagMounts mounts(found.transforms, options.base, options.mounts);
    mounts.require_known(found);
    if (options.is_list) return print_bag_list(options.path, *bag, found, options.topics, mounts);
    import_chosen(options, *bag, found, mounts);
  } catch (const io::DataError& error) {
    const std::string what = error.what();
    throw io::DataError(what.starts_with(options.path) ? what : options.path + ": " + what);
  }
}

void add_choices(CLI::App& command, BagImportOptions& options) {
  BagTopics& topics = options.topics;
  command.add_option("--cloud", topics.cloud,
                     "Topic of the 3-D laser, if there are several; none: no cloud");
  command.add_option("--scan", topics.scan, "Topic of the one-plane laser; likewise");
  command.add_option("--imu", topics.imu, "Topic of the IMU; likewise");
  command.add_option("--gnss", topics.gnss, "Topic of the fixes; likewise");
  command.add_option("--odometry", topics.odometry,
                     "Odometry of the wheels, or a twist: its speed becomes RAW_WHEELS");
  command.add_option("--truth", topics.truth, "Poses of a reference: GROUND_TRUTH");
}

void add_frames(CLI::App& command, BagImportOptions& options) {
  command.add_option("--base", options.base,
                     "Frame of the vehicle (default: base_link, base_footprint)");
  command
      .add_option("--mount", options.mounts,
                  "FRAME=x,y,z[,roll,pitch,yaw] [m, rad]: mount of a sensor")
      ->allow_extra_args(false);
  command.add_option(
      "--truth-frame", options.conversion.truth_frame,
      "Frame of the poses of --truth (default: as the messages say, else the vehicle)");
  command.add_option("--config", options.config, "Write a configuration folder for replay");
}

void add_readings(CLI::App& command, BagImportOptions& options) {
  BagConversion& conversion = options.conversion;
  command
      .add_option("--receive-time", options.receive_time,
                  "Topic with a wrong clock: its stamps are shifted to the recorder's clock; "
                  "stamps of 0 become the times of reception")
      ->allow_extra_args(false);
  add_cloud_options(command, conversion.cloud);
  command.add_option(
      "--model", conversion.laser.model,
      "Laser of the packets; default: as found from them. One of " + packets::known_models());
  command.add_option(
      "--metadata,--calibration", conversion.laser.source,
      "For packets: Ouster's metadata (JSON; default: the bag's), the HDL-64E's XML or YAML file, "
      "Hesai's angle correction file (CSV)");
  command
      .add_option("--wheelbase", conversion.wheelbase_m,
                  "Wheelbase, for the steering angle of RAW_WHEELS [m]")
      ->check(CLI::Range(0.1, 30.0))
      ->capture_default_str();
  command.add_flag("--speed-from-pose", conversion.has_speed_from_pose,
                   "RAW_WHEELS from the poses of --odometry, not from its twist");
}

}  // namespace

void add_bag_import(CLI::App& import) {
  const auto options = std::make_shared<BagImportOptions>();
  CLI::App* command = import.add_subcommand(
      "bag", "A ROS 1 bag, ROS 2 bag (SQLite, MCAP) or a folder of them, without ROS");
  command->add_option("path", options->path, "A file, or the folder of one recording")->required();
  command->add_option("--out", options->out, "The log to write");
  command->add_flag("--list", options->is_list,
                    "Show the contents and the import that would be made");
  add_choices(*command, *options);
  add_frames(*command, *options);
  add_readings(*command, *options);
  command->callback([options] { guarded_import([&] { import_bag(*options); }); });
}

}  // namespace understory::cli
