!> Result files: what is written reads back, resumption drops what came later, failures leave what
!> was published.
module test_results
   use, intrinsic :: iso_c_binding, only : c_int
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_errors, only : error_t, err_file
   use emcon_files, only : file_close, file_exists, file_open, file_put, file_remove, file_t, &
      make_directory
   use emcon_hdf5, only : hdf5_close, hdf5_file_t, hdf5_open
   use emcon_hdf5_data, only : hdf5_read_integers, hdf5_read_reals, hdf5_read_texts
   use emcon_history, only : column_t, history_append, history_close, history_create, &
      history_publish, history_put_run, history_resume, history_set_append, history_set_define, &
      history_t
   use emcon_kinds, only : dp, wp
   use emcon_log, only : log_close, log_line, log_open, log_t
   use emcon_restart, only : restart_read, restart_t, restart_write
   use emcon_restart_data, only : restart_check, restart_exchange, restart_list, restart_offers, &
      restart_rewind, restart_size
   use emcon_text, only : string_t, to_text
   use emcon_vtkhdf, only : field_t, vtkhdf_begin_frame, vtkhdf_close, vtkhdf_create, &
      vtkhdf_end_frame, vtkhdf_publish, vtkhdf_resume, vtkhdf_t, vtkhdf_write
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_results

   type(column_t), parameter :: columns(3) = [column_t("increment", .true.), column_t("time"), &
      column_t("total")]
   character(len=*), parameter :: extension(7) = [character(len=12) :: ".csv", ".h5", ".vtkhdf", &
      ".log", ".rst.h5", ".junk", ".vtkhdf.part"]

   interface
      function c_getpid() bind(c, name="getpid") result(pid)
         import :: c_int
         integer(c_int) :: pid
      end function c_getpid
   end interface

contains

   subroutine collect_results(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("history reads back", test_history), &
         test_case_t("history goes on", test_history_resumed), &
         test_case_t("fields read back and go on", test_fields), &
         test_case_t("published file outlives a failure", test_published), &
         test_case_t("restart comes back bit for bit", test_restart), &
         test_case_t("restart does not fit", test_restart_misfit), &
         test_case_t("restart is junk", test_restart_junk), &
         test_case_t("one run per output", test_lock), &
         test_case_t("full disk", test_full), &
         test_case_t("folders", test_folders)]
   end subroutine collect_results

   !> A path of our own, without extension, in the folder for temporary files.
   subroutine scratch(name, base)
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: base
      character(len=1024) :: folder
      integer :: stat

      call get_environment_variable("TMPDIR", folder, status=stat)
      if (stat /= 0 .or. folder == "") folder = "/tmp"
      base = trim(folder) // "/emcon_kernels_" // to_text(int(c_getpid())) // "_" // name
   end subroutine scratch

   subroutine remove_all(base)
      character(len=*), intent(in) :: base
      type(error_t), allocatable :: ignored
      integer :: i

      do i = 1, size(extension)
         call file_remove(base // trim(extension(i)), ignored)
      end do
   end subroutine remove_all

   !> Rows `first`..`last` of the sample: total = 1/(1 + increment), a set every second row.
   subroutine append_rows(history, first, last, error)
      type(history_t), intent(inout) :: history
      integer, intent(in) :: first, last
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: time, values(2, 3)
      integer :: i, i_set

      call history_set_define(history, "TOP/LEFT", "U", [11, 12, 30], 2, i_set, error)
      do i = first, last
         if (allocated(error)) return
         time = 0.1_dp*i
         values = time
         call history_append(history, [real(i, dp), time, 1.0_dp/(1 + i)], error)
         if (allocated(error) .or. modulo(i, 2) == 1) cycle
         call history_set_append(history, i_set, time, values, error)
      end do
   end subroutine append_rows

   subroutine test_history(error)
      type(error_t), allocatable, intent(out) :: error
      type(history_t) :: history
      type(string_t) :: deck(2)
      character(len=:), allocatable :: base

      call scratch("history", base)
      deck(1)%text = "*HEADING"
      deck(2)%text = " blanks around "
      call history_create(history, base, columns, error)
      if (.not. allocated(error)) call history_put_run(history, "run 1", deck, "1.0", error)
      if (.not. allocated(error)) call append_rows(history, 0, 100, error)
      if (.not. allocated(error)) call history_close(history, error)
      if (.not. allocated(error)) call check_history(base, 100, error)
      call remove_all(base)
   end subroutine test_history

   !> Killed after row 70 but published to row 60, resumed after row 50: same files as in one go.
   subroutine test_history_resumed(error)
      type(error_t), allocatable, intent(out) :: error
      type(history_t) :: killed, history
      type(string_t) :: deck(2)
      type(error_t), allocatable :: ignored
      character(len=:), allocatable :: base

      call scratch("resumed", base)
      deck(1)%text = "*HEADING"
      deck(2)%text = " blanks around "
      call history_create(killed, base, columns, error)
      if (.not. allocated(error)) call history_put_run(killed, "run 1", deck, "1.0", error)
      if (.not. allocated(error)) call append_rows(killed, 0, 60, error)
      if (.not. allocated(error)) call history_publish(killed, .true., error)
      if (.not. allocated(error)) call history_append(killed, [61.0_dp, 6.1_dp, 0.0_dp], error)
      if (.not. allocated(error)) call history_resume(history, base, "run 1", columns, &
         51, error)
      if (.not. allocated(error)) call append_rows(history, 51, 100, error)
      if (.not. allocated(error)) call history_close(history, error)
      if (.not. allocated(error)) call check_history(base, 100, error)
      call history_close(killed, ignored)      ! after all: of a process that goes on
      call remove_all(base)
   end subroutine test_history_resumed

   !> Both files hold the rows 0..`last` of `append_rows`.
   subroutine check_history(base, last, error)
      character(len=*), intent(in) :: base
      integer, intent(in) :: last
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_file_t) :: file
      type(error_t), allocatable :: ignored
      type(string_t), allocatable :: deck(:)
      real(dp), allocatable :: total(:), set_time(:)
      integer, allocatable :: increment(:), label(:)
      real(dp) :: time_csv, total_csv
      integer :: i, unit, stat, increment_csv
      character(len=80) :: line

      call hdf5_open(file, base // ".h5", .false., error)
      if (.not. allocated(error)) call hdf5_read_integers(file, "/history/increment", increment, &
         error)
      if (.not. allocated(error)) call hdf5_read_reals(file, "/history/total", total, error)
      if (.not. allocated(error)) call hdf5_read_reals(file, "/sets/TOP_LEFT/U_time", set_time, &
         error)
      if (.not. allocated(error)) call hdf5_read_integers(file, "/sets/TOP_LEFT/U_label", label, &
         error)
      if (.not. allocated(error)) call hdf5_read_texts(file, "/run/deck", deck, error)
      call hdf5_close(file, ignored)
      if (allocated(error)) return
      call check_equal(error, increment, [(i, i = 0, last)], "increments in NAME.h5")
      call check_equal(error, size(set_time), last/2 + 1, "times of the set")
      call check_equal(error, label, [11, 12, 30], "labels of the set")
      call check_equal(error, deck(2)%text, " blanks around ", "line of the deck")

      open(newunit=unit, file=base // ".csv", status="old", action="read")
      read(unit, "(a)") line
      call check_equal(error, trim(line), "increment,time,total", "header of NAME.csv")
      do i = 0, last
         read(unit, *, iostat=stat) increment_csv, time_csv, total_csv
         call check_true(error, stat == 0 .and. increment_csv == i, "row of NAME.csv")
         call check_true(error, time_csv == 0.1_dp*i .and. total_csv == total(i + 1), &
            "17 digits give the same bits")
      end do
      read(unit, *, iostat=stat) increment_csv
      call check_true(error, stat /= 0, "end of NAME.csv")
      close(unit)
   end subroutine check_history

   !> Begin a field file with two triangles; frame t has u = (t, 2t) and area = t.
   subroutine write_frames(vtk, first, last, error)
      type(vtkhdf_t), intent(inout) :: vtk
      integer, intent(in) :: first, last
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: u(2, 4), area(1, 2)
      integer :: i

      do i = first, last
         u(1, :) = real(i, dp)
         u(2, :) = real(2*i, dp)
         area = real(i, dp)
         call vtkhdf_begin_frame(vtk, 0.5_dp*i)
         call vtkhdf_write(vtk, "U", u, error)
         if (.not. allocated(error)) call vtkhdf_write(vtk, "area", area, error)
         if (.not. allocated(error)) call vtkhdf_end_frame(vtk, error)
         if (allocated(error)) return
      end do
   end subroutine write_frames

   subroutine create_sample(vtk, base, error)
      type(vtkhdf_t), intent(out) :: vtk
      character(len=*), intent(in) :: base
      type(error_t), allocatable, intent(out) :: error
      real(dp), parameter :: x(2, 4) = reshape([0, 0, 1, 0, 1, 1, 0, 1], [2, 4])

      call vtkhdf_create(vtk, base // ".vtkhdf", x, reshape([1, 2, 3, 0, 1, 3, 4, 0], [4, 2]), &
         [5, 5], sample_fields(), error)
   end subroutine create_sample

   function sample_fields() result(fields)
      type(field_t) :: fields(2)

      fields = [field_t("U", 2), field_t("area", 1, .true.)]
   end function sample_fields

   subroutine test_fields(error)
      type(error_t), allocatable, intent(out) :: error
      type(vtkhdf_t) :: vtk
      type(hdf5_file_t) :: file
      type(error_t), allocatable :: ignored
      character(len=:), allocatable :: base
      real(dp), allocatable :: u(:), time(:)
      integer, allocatable :: connectivity(:), offset(:)

      call scratch("fields", base)
      call create_sample(vtk, base, error)
      if (.not. allocated(error)) call write_frames(vtk, 1, 5, error)
      if (.not. allocated(error)) call vtkhdf_close(vtk, error)
      if (.not. allocated(error)) call vtkhdf_resume(vtk, base // ".vtkhdf", "", &
         sample_fields(), 2, error)
      if (.not. allocated(error)) call write_frames(vtk, 3, 3, error)
      if (.not. allocated(error)) call vtkhdf_close(vtk, error)
      if (.not. allocated(error)) call hdf5_open(file, base // ".vtkhdf", .false., error)
      if (.not. allocated(error)) call hdf5_read_reals(file, "/VTKHDF/PointData/U", u, error)
      if (.not. allocated(error)) call hdf5_read_reals(file, "/VTKHDF/Steps/Values", time, error)
      if (.not. allocated(error)) call hdf5_read_integers(file, "/VTKHDF/Connectivity", &
         connectivity, error)
      if (.not. allocated(error)) call hdf5_read_integers(file, &
         "/VTKHDF/Steps/PointDataOffsets/U", offset, error)
      call hdf5_close(file, ignored)
      call remove_all(base)
      if (allocated(error)) return
      call check_equal(error, connectivity, [0, 1, 2, 0, 2, 3], "connectivity")
      call check_equal(error, offset, [0, 4, 8], "offsets")
      call check_near(error, real(time, wp), [0.5_wp, 1.0_wp, 1.5_wp], 0.0_wp, 1.0_wp, "times")
      call check_equal(error, size(u), 3*4*3, "size of U")
      call check_near(error, real(u(25:27), wp), [3.0_wp, 6.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, &
         "U in the last frame")
   end subroutine test_fields

   !> A new run under an old name replaces the file only when it has something to show.
   subroutine test_published(error)
      type(error_t), allocatable, intent(out) :: error
      type(vtkhdf_t) :: old, new
      type(hdf5_file_t) :: file
      type(error_t), allocatable :: ignored
      character(len=:), allocatable :: base
      real(dp), allocatable :: before(:), after(:)

      call scratch("published", base)
      call create_sample(old, base, error)
      if (.not. allocated(error)) call write_frames(old, 1, 3, error)
      if (.not. allocated(error)) call vtkhdf_close(old, error)
      if (.not. allocated(error)) call create_sample(new, base, error)
      if (.not. allocated(error)) call write_frames(new, 1, 1, error)
      if (.not. allocated(error)) call hdf5_open(file, base // ".vtkhdf", .false., error)
      if (.not. allocated(error)) call hdf5_read_reals(file, "/VTKHDF/Steps/Values", before, error)
      if (.not. allocated(error)) call hdf5_close(file, error)
      if (.not. allocated(error)) call vtkhdf_publish(new, .false., error)
      if (.not. allocated(error)) call hdf5_open(file, base // ".vtkhdf", .false., error)
      if (.not. allocated(error)) call hdf5_read_reals(file, "/VTKHDF/Steps/Values", after, error)
      call hdf5_close(file, ignored)
      if (.not. allocated(error)) call vtkhdf_close(new, error)
      call remove_all(base)
      if (allocated(error)) return
      call check_equal(error, size(before), 3, "frames of the old file")
      call check_equal(error, size(after), 1, "frames of the new file")
   end subroutine test_published

   subroutine test_restart(error)
      type(error_t), allocatable, intent(out) :: error
      type(restart_t) :: put, got
      character(len=:), allocatable :: base
      type(string_t), allocatable :: texts(:), texts_back(:)
      real(wp) :: u(2, 3), u_back(2, 3), none(0)
      integer, allocatable :: numbers(:), numbers_back(:)
      logical :: flags(2)

      call scratch("restart", base)
      call draw_random(u)
      u(1, 1) = tiny(1.0_wp)
      u(2, 2) = -huge(1.0_wp)
      numbers = [3, -1, huge(1)]
      allocate(texts(2))
      texts(1)%text = " a "
      texts(2)%text = ""
      flags = [.true., .false.]
      call exchange(put, u, flags, numbers, texts)
      call restart_exchange(put, "none", none)
      call restart_write(put, base // ".rst.h5", error)
      if (.not. allocated(error)) call restart_read(got, base // ".rst.h5", error)
      call remove_all(base)
      if (allocated(error)) return
      flags = .not. flags
      call exchange(got, u_back, flags, numbers_back, texts_back)
      call restart_check(got, error)
      if (allocated(error)) return
      call check_true(error, all(u_back == u), "u comes back bit for bit")
      call check_true(error, flags(1) .and. .not. flags(2), "flags")
      call check_equal(error, numbers_back, numbers, "numbers")
      call check_equal(error, texts_back(1)%text, " a ", "first text")
      call check_equal(error, texts_back(2)%text, "", "second text")
      call check_equal(error, restart_size(got, "none"), 0, "size of the empty list")
      call check_equal(error, restart_size(got, "nobody"), -1, "size of what is not there")
      call check_true(error, restart_offers(put, "nobody", .true.), "a new one is written")
      call check_true(error, .not. restart_offers(got, "nobody", .true.), "what is not there")
   end subroutine test_restart

   !> Arrays in one piece, and one in three.
   subroutine exchange(restart, u, flags, numbers, texts)
      type(restart_t), intent(inout) :: restart
      real(wp), intent(inout) :: u(2, 3)
      logical, intent(inout) :: flags(2)
      integer, allocatable, intent(inout) :: numbers(:)
      type(string_t), allocatable, intent(inout) :: texts(:)

      call restart_exchange(restart, "u", u)
      call restart_exchange(restart, "parts", u(1, 1))
      call restart_exchange(restart, "parts", u(2, :))
      call restart_exchange(restart, "parts", u(:, :2))
      call restart_exchange(restart, "flags", flags)
      call restart_list(restart, "numbers", numbers)
      call restart_list(restart, "texts", texts)
   end subroutine exchange

   subroutine test_restart_misfit(error)
      type(error_t), allocatable, intent(out) :: error
      type(restart_t) :: restart
      type(error_t), allocatable :: raised
      real(wp) :: u(3)
      integer :: numbers(2)

      u = [1.0_wp, 2.0_wp, 3.0_wp]
      call restart_exchange(restart, "u", u(:2))
      call restart_rewind(restart)
      call restart_exchange(restart, "v", u)
      call restart_check(restart, raised)
      call check_error(error, raised, err_file, "missing", "unknown name")
      call restart_rewind(restart)
      call restart_exchange(restart, "u", u)
      call restart_check(restart, raised)
      call check_error(error, raised, err_file, "2 values, not 3", "too few values")
      call restart_rewind(restart)
      call restart_exchange(restart, "u", u(1))
      call restart_check(restart, raised)
      call check_error(error, raised, err_file, "2 values, not 1", "a value that is left")
      call restart_rewind(restart)
      call restart_exchange(restart, "u", numbers)
      call restart_check(restart, raised)
      call check_error(error, raised, err_file, "type", "wrong type")
   end subroutine test_restart_misfit

   subroutine test_restart_junk(error)
      type(error_t), allocatable, intent(out) :: error
      type(restart_t) :: restart
      type(file_t) :: file
      type(vtkhdf_t) :: vtk
      type(error_t), allocatable :: raised
      character(len=:), allocatable :: base

      call scratch("junk", base)
      call restart_read(restart, base // ".rst.h5", raised)
      call check_error(error, raised, err_file, "does not exist", "missing file")
      call file_open(file, base // ".rst.h5", "w", raised)
      call file_put(file, repeat("junk", 1000), raised)
      call file_close(file, raised)
      call restart_read(restart, base // ".rst.h5", raised)
      call check_error(error, raised, err_file, "has no checksum", "junk")
      call create_sample(vtk, base, raised)
      call vtkhdf_close(vtk, raised)
      call restart_read(restart, base // ".vtkhdf", raised)
      call check_error(error, raised, err_file, "not a file of this program", "another HDF5 file")
      call remove_all(base)
   end subroutine test_restart_junk

   subroutine test_lock(error)
      type(error_t), allocatable, intent(out) :: error
      type(log_t) :: first, second
      type(error_t), allocatable :: raised
      character(len=:), allocatable :: base

      call scratch("lock", base)
      call log_open(first, base // ".log", .false., error)
      if (allocated(error)) return
      call log_line(first, "a line")
      call log_open(second, base // ".log", .false., raised)
      call check_error(error, raised, err_file, "another run", "second log of the same name")
      call log_line(second, "goes nowhere")
      call log_close(first, raised)
      call check_true(error, .not. allocated(raised), "all lines were written")
      call log_open(second, base // ".log", .true., raised)
      call check_true(error, .not. allocated(raised), "the lock ends with the log")
      call log_close(second, raised)
      call remove_all(base)
   end subroutine test_lock

   !> Linux has a device that is always full.
   subroutine test_full(error)
      type(error_t), allocatable, intent(out) :: error
      type(file_t) :: file
      type(error_t), allocatable :: raised

      if (.not. file_exists("/dev/full")) return
      call file_open(file, "/dev/full", "w", error)
      if (allocated(error)) return
      call file_put(file, "a line" // achar(10), raised)
      call check_error(error, raised, err_file, "No space left", "write to a full disk")
      call check_error(error, raised, err_file, "/dev/full", "the message names the file")
      call file_close(file, raised)
   end subroutine test_full

   subroutine test_folders(error)
      type(error_t), allocatable, intent(out) :: error
      type(file_t) :: file
      type(error_t), allocatable :: raised
      character(len=:), allocatable :: base

      call scratch("folders", base)
      call file_open(file, base // ".junk", "w", error)
      if (allocated(error)) return
      call file_close(file, raised)
      call make_directory(base(:index(base, "/", back=.true.)), raised)
      call check_true(error, .not. allocated(raised), "a folder that is there")
      call make_directory(base // ".junk", raised)
      call check_error(error, raised, err_file, "a file has that name", "a file in the way")
      call make_directory(base // ".junk/sub", raised)
      call check_error(error, raised, err_file, "cannot make the folder", "a file on the way")
      call remove_all(base)
   end subroutine test_folders

end module test_results
