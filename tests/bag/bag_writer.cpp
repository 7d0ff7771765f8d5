#include "tests/bag/bag_writer.hpp"

#include <bzlib.h>
#include <lz4frame.h>
#include <sqlite3.h>
#include <zlib.h>
#include <zstd.h>

#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>

namespace understory::test {
namespace {

template <class T>
std::string le(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

std::string packed(const std::string& packing, const std::string& bytes) {
  std::string out;
  if (packing == "lz4") {
    out.resize(LZ4F_compressFrameBound(bytes.size(), nullptr));
    out.resize(LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr));
  } else if (packing == "zstd") {
    out.resize(ZSTD_compressBound(bytes.size()));
    out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3));
  } else if (packing == "bz2") {
    auto size = static_cast<unsigned int>(bytes.size() + bytes.size() / 50 + 700);
    out.resize(size);
    BZ2_bzBuffToBuffCompress(out.data(), &size, const_cast<char*>(bytes.data()),
                             static_cast<unsigned int>(bytes.size()), 9, 0, 0);
    out.resize(size);
  } else {
    out = bytes;
  }
  return out;
}

std::string as_text(const MessageBytes& data) { return {data.begin(), data.end()}; }

// ROS 1 -----------------------------------------------------------------------------------------

std::string field(const std::string& name, const std::string& value) {
  return le(static_cast<std::uint32_t>(name.size() + 1 + value.size())) + name + "=" + value;
}

std::string ros1_record(const std::string& header, const std::string& data) {
  return le(static_cast<std::uint32_t>(header.size())) + header +
         le(static_cast<std::uint32_t>(data.size())) + data;
}

std::string op(char code) { return field("op", std::string(1, code)); }

std::string ros1_time(std::int64_t time_ns) {
  return le(static_cast<std::uint32_t>(time_ns / 1'000'000'000)) +
         le(static_cast<std::uint32_t>(time_ns % 1'000'000'000));
}

class Ros1Writer {
 public:
  explicit Ros1Writer(const BagForm& form) : form_(form) {}

  std::string bag(const std::vector<Recorded>& messages) {
    out_ = "#ROSBAG V2.0\n" + header(0, 0);
    for (const Recorded& message : messages) {
      add(message);
      if (chunk_.size() >= form_.chunk_bytes) end_chunk();
    }
    end_chunk();
    if (!form_.has_index) return out_;

    const std::uint64_t index = out_.size();
    for (const auto& [topic, id] : ids_) out_ += connection(topic, id);
    for (const std::string& info : infos_) out_ += info;
    const std::string closed = header(index, static_cast<std::uint32_t>(infos_.size()));
    return out_.replace(13, closed.size(), closed);
  }

 private:
  std::string header(std::uint64_t index, std::uint32_t chunks) const {
    const std::string fields = field("chunk_count", le(chunks)) +
                               field("conn_count", le(static_cast<std::uint32_t>(ids_.size()))) +
                               field("index_pos", le(index)) + op(3);
    return ros1_record(fields, std::string(4096 - 8 - fields.size(), ' '));
  }
  std::string connection(const std::string& topic, std::uint32_t id) const {
    return ros1_record(field("conn", le(id)) + op(7) + field("topic", topic),
                       field("md5sum", "0") + field("message_definition", "float64 x\n") +
                           field("topic", topic) + field("type", types_.at(topic)));
  }
  void add(const Recorded& message) {
    if (!ids_.contains(message.topic)) {
      const auto id = static_cast<std::uint32_t>(ids_.size());
      ids_[message.topic] = id;
      types_[message.topic] = message.type;
      chunk_ += connection(message.topic, id);
    }
    const std::uint32_t id = ids_[message.topic];
    index_[id] += ros1_time(message.time_ns) + le(static_cast<std::uint32_t>(chunk_.size()));
    chunk_ += ros1_record(field("conn", le(id)) + op(2) + field("time", ros1_time(message.time_ns)),
                          as_text(message.data));
  }
  void end_chunk() {
    if (chunk_.empty()) return;
    const std::uint64_t place = out_.size();
    out_ += ros1_record(field("compression", form_.packing) + op(5) +
                            field("size", le(static_cast<std::uint32_t>(chunk_.size()))),
                        packed(form_.packing, chunk_));
    for (const auto& [id, entries] : index_) {
      const auto count = static_cast<std::uint32_t>(entries.size() / 12);
      out_ += ros1_record(field("conn", le(id)) + field("count", le(count)) + op(4) +
                              field("ver", le(std::uint32_t{1})),
                          entries);
    }
    infos_.push_back(ros1_record(field("chunk_pos", le(place)) + op(6), ""));
    index_.clear();
    chunk_.clear();
  }

  const BagForm& form_;
  std::string out_;
  std::string chunk_;
  std::map<std::string, std::uint32_t> ids_;
  std::map<std::string, std::string> types_;
  std::map<std::uint32_t, std::string> index_;
  std::vector<std::string> infos_;
};

// MCAP ------------------------------------------------------------------------------------------

std::string mcap_text(const std::string& value) {
  return le(static_cast<std::uint32_t>(value.size())) + value;
}

std::string mcap_record(std::uint8_t opcode, const std::string& content) {
  return le(opcode) + le(static_cast<std::uint64_t>(content.size())) + content;
}

class McapWriter {
 public:
  explicit McapWriter(const BagForm& form) : form_(form) {}

  std::string bag(const std::vector<Recorded>& messages) {
    out_ = std::string("\x89MCAP0\r\n", 8) + mcap_record(1, mcap_text("ros2") + mcap_text("test"));
    for (const Recorded& message : messages) {
      add(message);
      if (form_.has_chunks && chunk_.size() >= form_.chunk_bytes) end_chunk();
    }
    end_chunk();
    out_ += mcap_record(0x0F, le(std::uint32_t{0}));
    const std::uint64_t summary = out_.size();
    if (form_.has_index) out_ += declarations_;
    out_ += mcap_record(2, le(form_.has_index ? summary : std::uint64_t{0}) + le(std::uint64_t{0}) +
                               le(std::uint32_t{0}));
    return out_ + std::string("\x89MCAP0\r\n", 8);
  }

 private:
  void append(const std::string& record) { (form_.has_chunks ? chunk_ : out_) += record; }
  void add(const Recorded& message) {
    if (!ids_.contains(message.topic)) {
      const auto id = static_cast<std::uint16_t>(ids_.size() + 1);
      ids_[message.topic] = id;
      std::string type = message.type;
      type.replace(type.find('/'), 1, "/msg/");
      const std::string declared =
          mcap_record(3, le(id) + mcap_text(type) + mcap_text("ros2msg") + mcap_text("float64 x")) +
          mcap_record(4, le(id) + le(id) + mcap_text(message.topic) +
                             mcap_text(message.topic == "/other" ? "json" : "cdr") +
                             le(std::uint32_t{0}));
      declarations_ += declared;
      append(declared);
    }
    const std::uint16_t id = ids_[message.topic];
    const auto time = static_cast<std::uint64_t>(message.time_ns);
    index_[id] += le(time) + le(static_cast<std::uint64_t>(chunk_.size()));
    first_ = std::min(first_, time);
    last_ = std::max(last_, time);
    append(mcap_record(
        5, le(id) + le(std::uint32_t{0}) + le(time) + le(time) + as_text(message.data)));
  }
  void end_chunk() {
    if (chunk_.empty()) return;
    const std::string bytes = packed(form_.packing, chunk_);
    const auto crc = static_cast<std::uint32_t>(
        crc32_z(0, reinterpret_cast<const Bytef*>(chunk_.data()), chunk_.size()));
    out_ += mcap_record(6, le(first_) + le(last_) + le(static_cast<std::uint64_t>(chunk_.size())) +
                               le(crc) + mcap_text(form_.packing == "none" ? "" : form_.packing) +
                               le(static_cast<std::uint64_t>(bytes.size())) + bytes);
    if (form_.has_index) {
      for (const auto& [id, entries] : index_) out_ += mcap_record(7, le(id) + mcap_text(entries));
    }
    index_.clear();
    chunk_.clear();
    first_ = std::numeric_limits<std::uint64_t>::max();
    last_ = 0;
  }

  const BagForm& form_;
  std::string out_;
  std::string chunk_;
  std::string declarations_;
  std::map<std::string, std::uint16_t> ids_;
  std::map<std::uint16_t, std::string> index_;
  std::uint64_t first_ = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t last_ = 0;
};

// SQLite ----------------------------------------------------------------------------------------

void write_sqlite(const std::filesystem::path& path, const BagForm& form,
                  const std::vector<Recorded>& messages) {
  std::filesystem::remove(path);
  sqlite3* file = nullptr;
  sqlite3_open(path.c_str(), &file);
  const auto run = [&](const std::string& sql) {
    if (sqlite3_exec(file, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
      throw std::runtime_error(sqlite3_errmsg(file));
  };
  run("BEGIN; CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,"
      "serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL, timestamp INTEGER "
      "NOT "
      "NULL, data BLOB NOT NULL);");
  if (form.has_index) run("CREATE INDEX timestamp_idx ON messages (timestamp ASC);");

  std::map<std::string, int> ids;
  for (const Recorded& message : messages) {
    if (!ids.contains(message.topic)) {
      ids.emplace(message.topic, static_cast<int>(ids.size()) + 1);
      std::string type = message.type;
      type.replace(type.find('/'), 1, "/msg/");
      run("INSERT INTO topics VALUES(" + std::to_string(ids[message.topic]) + ",'" + message.topic +
          "','" + type + "','" + (message.topic == "/other" ? "json" : "cdr") + "','')");
    }
    sqlite3_stmt* insert = nullptr;
    sqlite3_prepare_v2(file, "INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)", -1,
                       &insert, nullptr);
    sqlite3_bind_int(insert, 1, ids[message.topic]);
    sqlite3_bind_int64(insert, 2, message.time_ns);
    sqlite3_bind_blob(insert, 3, message.data.empty() ? "" : as_text(message.data).c_str(),
                      static_cast<int>(message.data.size()), SQLITE_TRANSIENT);
    sqlite3_step(insert);
    sqlite3_finalize(insert);
  }
  run("COMMIT;");
  sqlite3_close(file);
}

}  // namespace

std::string BagForm::file() const {
  return kind == Kind::kRos1 ? "run.bag" : kind == Kind::kSqlite ? "run.db3" : "run.mcap";
}

std::string BagForm::name() const {
  return file() + " " + packing + (has_index ? "" : " without index") +
         (has_chunks ? "" : " without chunks");
}

std::vector<BagForm> all_bag_forms() {
  using Kind = BagForm::Kind;
  std::vector<BagForm> forms;
  for (const bool has_index : {true, false}) {
    for (const char* packing : {"none", "lz4", "bz2"})
      forms.push_back({Kind::kRos1, packing, has_index});
    for (const char* packing : {"none", "lz4", "zstd"})
      forms.push_back({Kind::kMcap, packing, has_index});
    forms.push_back({Kind::kSqlite, "none", has_index});
  }
  forms.push_back({Kind::kMcap, "none", false, false});
  return forms;
}

void write_bag(const std::filesystem::path& path, const BagForm& form,
               const std::vector<Recorded>& messages) {
  if (form.kind == BagForm::Kind::kSqlite) return write_sqlite(path, form, messages);
  set_file_bytes(path, form.kind == BagForm::Kind::kRos1 ? Ros1Writer(form).bag(messages)
                                                         : McapWriter(form).bag(messages));
}

std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void set_file_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace understory::test
