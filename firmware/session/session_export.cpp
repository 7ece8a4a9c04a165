#include "firmware/session/session_export.hpp"

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <xxhash.h>

#include <fmt/format.h>

#include "firmware/base/atomic_files.hpp"
#include "firmware/base/check.hpp"
#include "firmware/base/file.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/session/layout.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kChunkBytes = std::size_t{1} << 20U;

/// XXH3, 128 bit, of bytes that come in pieces.
class ContentHash {
 public:
  ContentHash() : state_(XXH3_createState(), &XXH3_freeState) {
    TM_CHECK(state_ != nullptr);
    XXH3_128bits_reset(state_.get());
  }

  void add(std::string_view bytes) {
    XXH3_128bits_update(state_.get(), bytes.data(), bytes.size());
  }

  /// 32 hexadecimal digits, as xxh128sum writes them.
  [[nodiscard]] std::string text() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(state_.get());
    return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
  }

 private:
  std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state_;
};

class SessionCopier {
 public:
  SessionCopier(FileSystem& files, const ExportProgress& progress, std::uint64_t all_bytes)
      : files_(files), progress_(progress), all_bytes_(all_bytes), chunk_(kChunkBytes) {}

  /// `inside`: where the folder is, seen from the session; for the list of hashes.
  [[nodiscard]] Result<> copy_folder(const fs::path& from,
                                     const fs::path& to,
                                     const fs::path& inside) {
    const auto entries = files_.list(from);
    if (!entries) {
      return tl::unexpected<Error>(system_error(entries.error(), "cannot list", from));
    }
    TM_RETURN_IF_ERROR(make_directory(files_, to));
    for (const FolderEntry& entry : *entries) {
      if (is_hidden_name(entry.name) || entry.status.kind == FileKind::kOther) {
        continue;
      }
      const bool is_folder = entry.status.kind == FileKind::kFolder;
      TM_RETURN_IF_ERROR(
          is_folder ? copy_folder(from / entry.name, to / entry.name, inside / entry.name)
                    : copy_verified(from / entry.name, to / entry.name, inside / entry.name));
    }
    return sync_directory(files_, to);
  }

  [[nodiscard]] const std::string& checksums() const { return checksums_; }

  [[nodiscard]] std::size_t file_count() const { return file_count_; }

  [[nodiscard]] std::uint64_t copied_bytes() const { return copied_bytes_; }

 private:
  [[nodiscard]] Result<> copy_verified(const fs::path& from,
                                       const fs::path& to,
                                       const fs::path& inside) {
    TM_ASSIGN_OR_RETURN(const std::string written, copy_file(from, to));
    TM_ASSIGN_OR_RETURN(const std::string read_back, hash_on_device(to));
    if (written != read_back) {
      return fail(ErrorCode::kCorruptData,
                  "cannot export {}: the copy {} reads back differently; the stick is defective",
                  from.string(),
                  to.string());
    }
    checksums_ += fmt::format("{}  {}\n", written, inside.generic_string());
    ++file_count_;
    return {};
  }

  /// The hash of what was read.
  [[nodiscard]] Result<std::string> copy_file(const fs::path& from, const fs::path& to) {
    TM_ASSIGN_OR_RETURN(File source, File::open(files_, from, OpenMode::kRead));
    TM_ASSIGN_OR_RETURN(File target, File::open(files_, to, OpenMode::kCreate));
    ContentHash hash;
    while (true) {
      TM_ASSIGN_OR_RETURN(const std::size_t got, source.read(chunk_));
      if (got == 0) {
        break;
      }
      const std::string_view bytes(chunk_.data(), got);
      TM_RETURN_IF_ERROR(target.write(bytes));
      hash.add(bytes);
      copied_bytes_ += got;
      if (progress_ && !progress_(copied_bytes_, all_bytes_)) {
        return fail(ErrorCode::kCancelled, "the export was stopped");
      }
    }
    TM_RETURN_IF_ERROR(target.sync());
    TM_RETURN_IF_ERROR(target.close());
    return hash.text();
  }

  [[nodiscard]] Result<std::string> hash_on_device(const fs::path& path) {
    TM_ASSIGN_OR_RETURN(File file, File::open(files_, path, OpenMode::kRead));
    TM_RETURN_IF_ERROR(file.forget_cached());
    ContentHash hash;
    while (true) {
      TM_ASSIGN_OR_RETURN(const std::size_t got, file.read(chunk_));
      if (got == 0) {
        return hash.text();
      }
      hash.add({chunk_.data(), got});
    }
  }

  FileSystem& files_;
  const ExportProgress& progress_;
  std::uint64_t all_bytes_;
  std::vector<char> chunk_;
  std::string checksums_;
  std::size_t file_count_ = 0;
  std::uint64_t copied_bytes_ = 0;
};

Result<> check_places(FileSystem& files, const fs::path& session, const fs::path& destination) {
  for (const fs::path& folder : {session, destination}) {
    const auto status = files.status(folder);
    if (!status || status->kind != FileKind::kFolder) {
      return fail(ErrorCode::kNotFound,
                  "cannot export {} to {}: there is no folder {}",
                  session.string(),
                  destination.string(),
                  folder.string());
    }
  }
  return {};
}

Result<> check_space(FileSystem& files, const fs::path& destination, std::uint64_t bytes) {
  const auto space = files.space(destination);
  if (!space) {
    return tl::unexpected<Error>(
        system_error(space.error(), "cannot ask for the free space of", destination));
  }
  if (space->free_bytes < bytes) {
    return fail(ErrorCode::kNoSpace,
                "cannot export to {}: {} bytes are needed, {} are free",
                destination.string(),
                bytes,
                space->free_bytes);
  }
  return {};
}

}  // namespace

Result<ExportReport> export_session(FileSystem& files,
                                    const fs::path& session,
                                    const fs::path& destination,
                                    const ExportProgress& progress) {
  TM_RETURN_IF_ERROR(check_places(files, session, destination));
  const std::string name = session.filename().string();
  const fs::path target = destination / name;
  const fs::path staged = destination / fmt::format(".{}.part", name);
  TM_RETURN_IF_ERROR(remove_tree(files, staged));  // of an export that was cut
  TM_RETURN_IF_ERROR(finish_replacement(files, target));
  TM_ASSIGN_OR_RETURN(const std::uint64_t all_bytes, tree_size_bytes(files, session));
  TM_RETURN_IF_ERROR(check_space(files, destination, all_bytes));
  SessionCopier copier(files, progress, all_bytes);
  Result<> done = copier.copy_folder(session, staged, {});
  if (done) {
    done = write_file_atomically(files, staged / kChecksumsName, copier.checksums());
  }
  if (done) {
    done = replace_directory(files, staged, target);
  }
  if (!done) {
    (void)remove_tree(files, staged);  // the report is about the first failure
    return tl::unexpected<Error>(std::move(done).error());
  }
  return ExportReport{target, copier.file_count(), copier.copied_bytes()};
}

}  // namespace trigmesh
