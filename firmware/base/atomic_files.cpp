#include "firmware/base/atomic_files.hpp"

#include <cerrno>
#include <utility>

#include "firmware/base/check.hpp"
#include "firmware/base/file.hpp"
#include "firmware/base/file_bytes.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> system_failure(int error_number,
                                     std::string_view attempt,
                                     const fs::path& path) {
  return tl::unexpected<Error>(system_error(error_number, attempt, path));
}

Result<> write_new_file(FileSystem& files,
                        const fs::path& path,
                        std::string_view bytes,
                        Durability durability) {
  TM_ASSIGN_OR_RETURN(File file, File::open(files, path, OpenMode::kCreate));
  TM_RETURN_IF_ERROR(file.write(bytes));
  if (durability == Durability::kSynced) {
    TM_RETURN_IF_ERROR(file.sync());
  }
  return file.close();
}

/// The folder that holds `path`, also for "model/" with a slash at the end.
fs::path parent_of(const fs::path& path) {
  return path.has_filename() ? path.parent_path() : path.parent_path().parent_path();
}

fs::path without_trailing_slash(const fs::path& path) {
  return path.has_filename() ? path : path.parent_path();
}

fs::path aside_of(const fs::path& target) {
  fs::path aside = target;
  aside += ".old";
  return aside;
}

/// For file systems without an exchange: old aside, new in, old away.
Result<> replace_in_two_steps(FileSystem& files, const fs::path& staged, const fs::path& target) {
  const fs::path aside = aside_of(target);
  TM_RETURN_IF_ERROR(remove_tree(files, aside));
  if (const auto done = files.rename(target, aside); !done) {
    return system_failure(done.error(), "cannot set aside", target);
  }
  if (const auto done = files.rename(staged, target); !done) {
    (void)files.rename(aside, target);  // the report is about the first failure
    return system_failure(done.error(), "cannot replace", target);
  }
  TM_RETURN_IF_ERROR(sync_directory(files, parent_of(target)));
  (void)remove_tree(files, aside);  // the old folder may stay; the new one is in place
  return {};
}

/// What is missing is a place for output, not an input.
tl::unexpected<Error> output_failure(Error error) {
  if (error.code == ErrorCode::kNotFound) {
    error.code = ErrorCode::kIo;
  }
  return tl::unexpected<Error>(std::move(error));
}

}  // namespace

Result<> write_file_atomically(FileSystem& files,
                               const fs::path& path,
                               std::string_view bytes,
                               Durability durability) {
  const fs::path part = path.parent_path() / fmt::format(".{}.part", path.filename().string());
  Result<> done = write_new_file(files, part, bytes, durability);
  if (done) {
    if (const auto renamed = files.rename(part, path); !renamed) {
      done = system_failure(renamed.error(), "cannot write", path);
    }
  }
  if (!done) {
    (void)files.remove_file(part);  // it may never have been made
    return output_failure(std::move(done).error());
  }
  return durability == Durability::kSynced ? sync_directory(files, path.parent_path()) : Result<>();
}

Result<> write_file_atomically(const fs::path& path,
                               std::string_view bytes,
                               Durability durability) {
  return write_file_atomically(real_file_system(), path, bytes, durability);
}

Result<> make_directory(FileSystem& files, const fs::path& path, Durability durability) {
  const fs::path folder = without_trailing_slash(path);
  const SystemResult<FileStatus> found = files.status(folder);
  if (found && found->kind == FileKind::kFile) {
    return system_failure(EEXIST, "cannot make the folder", path);
  }
  if (found) {
    return {};
  }
  if (found.error() != ENOENT) {
    const int reason = found.error() == ENOTDIR ? EEXIST : found.error();
    return system_failure(reason, "cannot make the folder", path);
  }
  if (folder.has_parent_path() && folder.parent_path() != folder) {
    TM_RETURN_IF_ERROR(make_directory(files, folder.parent_path(), durability));
  }
  const SystemResult<> made = files.make_folder(folder);
  if (!made && made.error() != EEXIST) {
    return output_failure(system_error(made.error(), "cannot make the folder", path));
  }
  return durability == Durability::kSynced ? sync_directory(files, folder.parent_path())
                                           : Result<>();
}

Result<> make_directory(const fs::path& path) {
  return make_directory(real_file_system(), path);
}

Result<> sync_directory(FileSystem& files, const fs::path& folder) {
  const fs::path name = folder.empty() ? fs::path(".") : folder;
  const SystemResult<int> fd = files.open(name, OpenMode::kRead);
  if (!fd) {
    return system_failure(fd.error(), "cannot open the folder", name);
  }
  const SystemResult<> synced = files.sync(*fd);
  (void)files.close(*fd);  // nothing was written through it
  if (!synced && synced.error() != EINVAL) {
    return system_failure(synced.error(), "cannot put on the disk the folder", name);
  }
  return {};
}

Result<> sync_tree(FileSystem& files, const fs::path& folder) {
  const auto entries = files.list(folder);
  if (!entries) {
    return system_failure(entries.error(), "cannot list", folder);
  }
  for (const FolderEntry& entry : *entries) {
    const fs::path path = folder / entry.name;
    if (entry.status.kind == FileKind::kFolder) {
      TM_RETURN_IF_ERROR(sync_tree(files, path));
    } else if (entry.status.kind == FileKind::kFile) {
      TM_ASSIGN_OR_RETURN(File file, File::open(files, path, OpenMode::kRead));
      TM_RETURN_IF_ERROR(file.sync());
    }
  }
  return sync_directory(files, folder);
}

Result<> remove_tree(FileSystem& files, const fs::path& path) {
  const SystemResult<FileStatus> found = files.status(path);
  if (!found) {
    return found.error() == ENOENT || found.error() == ENOTDIR
               ? Result<>()
               : system_failure(found.error(), "cannot remove", path);
  }
  if (found->kind == FileKind::kFolder) {
    const auto entries = files.list(path);
    if (!entries) {
      return system_failure(entries.error(), "cannot remove", path);
    }
    for (const FolderEntry& entry : *entries) {
      TM_RETURN_IF_ERROR(remove_tree(files, path / entry.name));
    }
  }
  const SystemResult<> removed =
      found->kind == FileKind::kFolder ? files.remove_folder(path) : files.remove_file(path);
  return removed || removed.error() == ENOENT
             ? Result<>()
             : system_failure(removed.error(), "cannot remove", path);
}

Result<std::uint64_t> tree_size_bytes(FileSystem& files, const fs::path& folder) {
  const auto entries = files.list(folder);
  if (!entries && entries.error() == ENOENT) {
    return 0U;
  }
  if (!entries) {
    return system_failure(entries.error(), "cannot list", folder);
  }
  std::uint64_t sum_bytes = 0;
  for (const FolderEntry& entry : *entries) {
    sum_bytes += entry.status.size_bytes;
    if (entry.status.kind == FileKind::kFolder) {
      TM_ASSIGN_OR_RETURN(const std::uint64_t inside, tree_size_bytes(files, folder / entry.name));
      sum_bytes += inside;
    }
  }
  return sum_bytes;
}

Result<> replace_directory(FileSystem& files,
                           const fs::path& staged_path,
                           const fs::path& target_path) {
  const fs::path staged = without_trailing_slash(staged_path);
  const fs::path target = without_trailing_slash(target_path);
  const SystemResult<> exchanged = files.exchange(staged, target);
  if (exchanged) {
    TM_RETURN_IF_ERROR(sync_directory(files, parent_of(target)));
    (void)remove_tree(files, staged);  // the old folder may stay; the new one is in place
    return {};
  }
  if (exchanged.error() == ENOENT) {  // nothing to replace, or nothing staged: then this fails too
    if (const auto renamed = files.rename(staged, target); !renamed) {
      return system_failure(renamed.error(), "cannot move the finished folder to", target);
    }
    return sync_directory(files, parent_of(target));
  }
  if (exchanged.error() == EINVAL || exchanged.error() == ENOSYS) {
    return replace_in_two_steps(files, staged, target);
  }
  return system_failure(exchanged.error(), "cannot replace", target);
}

Result<> replace_directory(const fs::path& staged, const fs::path& target) {
  return replace_directory(real_file_system(), staged, target);
}

Result<> finish_replacement(FileSystem& files, const fs::path& target) {
  const fs::path aside = aside_of(target);
  if (!files.status(aside)) {
    return {};
  }
  if (files.status(target)) {
    return remove_tree(files, aside);
  }
  if (const auto renamed = files.rename(aside, target); !renamed) {
    return system_failure(renamed.error(), "cannot put back", target);
  }
  return sync_directory(files, parent_of(target));
}

}  // namespace trigmesh
