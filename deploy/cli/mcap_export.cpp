#include "deploy/cli/mcap_export.hpp"

#include <array>

#include "common/foxglove/converter.hpp"
#include "common/io/lcm_log.hpp"
#include "common/mcap/writer.hpp"
#include "common/terminal/interrupt.hpp"

namespace understory::cli {
namespace {

/// Channels of the file by topic, made at the first message.
class McapTopics {
 public:
  explicit McapTopics(mcap::Writer& writer) : writer_(writer) {}

  void write(const foxglove::Converted& message) {
    Line& line = lines_[static_cast<std::size_t>(message.topic)];
    if (line.channel == 0) line.channel = add(message.topic);
    writer_.write({line.channel, line.sequence++, message.log_time_ns, message.publish_time_ns,
                   *message.json});
  }

 private:
  struct Line {
    std::uint16_t channel = 0;
    std::uint32_t sequence = 0;
  };

  std::uint16_t add(foxglove::TopicId id) {
    const foxglove::Topic& topic = foxglove::topic(id);
    std::uint16_t& schema = schemas_[std::string(topic.schema_name)];
    if (schema == 0) {
      schema =
          writer_.add(mcap::Schema{std::string(topic.schema_name), "jsonschema", schema_of(id)});
    }
    return writer_.add(mcap::Channel{schema, std::string(topic.name), "json", {}});
  }

  mcap::Writer& writer_;
  std::map<std::string, std::uint16_t> schemas_;  ///< Schema ids by name.
  std::array<Line, foxglove::kTopics> lines_;
};

}  // namespace

std::filesystem::path mcap_path(const std::filesystem::path& log,
                                const std::filesystem::path& out) {
  return out.extension() == ".mcap" ? out : out / log.filename().replace_extension(".mcap");
}

McapSummary export_mcap(const std::string& log, const std::filesystem::path& file) {
  io::LcmLogReader reader(log);
  mcap::Writer writer(file);
  McapTopics topics(writer);
  foxglove::Converter converter;
  terminal::Progress progress("writing " + file.string(), static_cast<double>(reader.size_bytes()));
  while (const auto event = reader.next()) {
    terminal::throw_if_interrupted();
    for (const auto& message : converter.take(event->channel, event->data, event->utime)) {
      topics.write(message);
    }
    progress.update(static_cast<double>(reader.position_bytes()));
  }

  reader.refuse_other_files();
  writer.commit();
  return {writer.statistics().message_count, converter.refused(), converter.landmarks_left_out()};
}

}  // namespace understory::cli
