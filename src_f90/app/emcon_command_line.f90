!> The command line of the program.
module emcon_command_line
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_run, only : run_options_t
   use emcon_text, only : nearest_word, read_real, string_t
   use emcon_threads, only : threads_check
   implicit none
   private
   public :: command_t, command_read, usage

   !> Commands that are made in Python, beside those of the program.
   character(len=*), parameter :: of_package(7) = [character(len=7) :: "plot", "animate", &
      "export", "compare", "summary", "mesh", "study"]

   type :: command_t
      character(len=:), allocatable :: verb      !! run, check, restart, keywords, version or help
      character(len=:), allocatable :: path      !! of keywords: what their names begin with
      type(run_options_t) :: options
      character(len=:), allocatable :: fault     !! what is wrong with the command line, or empty
   end type command_t

contains

   !> Take the arguments of the program apart.
   subroutine command_read(self)
      type(command_t), intent(out) :: self
      character(len=:), allocatable :: word
      integer :: i, n_plain

      self%verb = "run"
      self%path = ""
      self%fault = ""
      self%options%folder = ""
      allocate(self%options%override(0))
      n_plain = 0
      i = 0
      if (command_argument_count() == 0) self%verb = "help"
      do while (i < command_argument_count() .and. len(self%fault) == 0)
         i = i + 1
         call argument(i, word)
         if (len(word) > 1 .and. word(1:1) == "-") then
            call take_option(self, word, i)
         else
            n_plain = n_plain + 1
            call take_word(self, word, n_plain)
         end if
      end do
      if (len(self%fault) > 0 .or. self%verb == "help" .or. self%verb == "version") return
      if (len(self%path) == 0 .and. self%verb /= "keywords") self%fault = "no file is named"
      if (self%options%is_json .and. self%verb /= "check") self%fault = &
         "--json is for emcon check; a run writes NAME.json"
      call check_restart(self)
   end subroutine command_read

   !> What a restart takes, and nothing else does.
   subroutine check_restart(self)
      type(command_t), intent(inout) :: self
      logical :: has_more

      associate (options => self%options)
         has_more = options%further%until > 0.0_wp .or. allocated(options%further%path)
         if (self%verb /= "restart") then
            if (has_more) self%fault = "--until and --steps are for emcon restart"
         else if (size(options%override) > 0 .or. options%is_lenient) then
            self%fault = "a restart goes on with the parameters of its run: it takes " // &
               "--output, --until, --steps, --quiet, --strict and --threads only"
         else if (has_more .and. len(options%folder) == 0) then
            self%fault = "with --until or --steps a restart makes results of its own: name a " // &
               "folder with --output"
         end if
      end associate
   end subroutine check_restart

   !> A word that is no option: the verb, or the file.
   subroutine take_word(self, word, n_plain)
      type(command_t), intent(inout) :: self
      character(len=*), intent(in) :: word
      integer, intent(inout) :: n_plain
      type(string_t) :: verb(4)
      character(len=:), allocatable :: near

      verb = [string_t("run"), string_t("check"), string_t("restart"), string_t("keywords")]
      call nearest_word(self%path, verb, near)
      if (n_plain == 1 .and. any(word == [character(len=8) :: "run", "check", "restart", &
         "keywords"])) then
         self%verb = word
      else if (n_plain == 1 .and. any(word == of_package)) then
         self%fault = "'" // word // "' is a command of the Python package: python -m emcon " &
            // word
      else if (len(self%path) == 0) then
         self%path = word
      else
         self%fault = "'" // word // "' is one file too many after '" // self%path // "'"
         if (len(near) > 0) self%fault = self%fault // "; did you mean " // near // "?"
      end if
   end subroutine take_word

   subroutine take_option(self, word, i)
      type(command_t), intent(inout) :: self
      character(len=*), intent(in) :: word
      integer, intent(inout) :: i                !! number of the argument, moved past a value
      character(len=:), allocatable :: name, value, near
      type(string_t) :: override(1)
      integer :: equals

      equals = index(word, "=")
      name = word
      value = ""
      if (equals > 0) then
         name = word(:equals - 1)
         value = word(equals + 1:)
      end if
      select case (name)
      case ("--help", "-h")
         self%verb = "help"
      case ("--version")
         self%verb = "version"
      case ("--lenient")
         self%options%is_lenient = .true.
      case ("--quiet", "-q")
         self%options%is_quiet = .true.
      case ("--strict")
         self%options%is_strict = .true.
      case ("--json")
         self%options%is_json = .true.
      case ("--output", "--set", "--threads", "--until", "--steps")
         if (equals == 0) call take_value(i, value)
         if (len(value) == 0 .and. name /= "--set") self%fault = name // " needs a value"
         if (name == "--output") then
            call without_slash(value, self%options%folder)
         else if (name == "--threads") then
            call take_threads(self, value)
         else if (name == "--until") then
            call take_until(self, value)
         else if (name == "--steps") then
            self%options%further%path = value
         else
            override(1)%text = value
            self%options%override = [self%options%override, override]
         end if
      case default
         self%fault = "unknown option " // name
         call near_option(name, near)
         if (len(near) > 0) self%fault = self%fault // "; did you mean " // near // "?"
      end select
   end subroutine take_option

   !> The argument behind number `i`, unless it is an option.
   subroutine take_value(i, value)
      integer, intent(inout) :: i                !! moved on to the value
      character(len=:), allocatable, intent(inout) :: value
      character(len=:), allocatable :: word

      if (i == command_argument_count()) return
      call argument(i + 1, word)
      if (index(word, "--") == 1) return
      i = i + 1
      value = word
   end subroutine take_value

   !> Take a later end; what is none is a fault.
   subroutine take_until(self, value)
      type(command_t), intent(inout) :: self
      character(len=*), intent(in) :: value
      logical :: is_number

      if (len(self%fault) > 0) return
      call read_real(value, self%options%further%until, is_number)
      if (is_number) is_number = self%options%further%until > 0.0_wp
      if (.not. is_number) self%fault = "--until takes a time, not '" // value // "'"
   end subroutine take_until

   !> Take a number of threads; what there cannot be is a fault.
   subroutine take_threads(self, value)
      type(command_t), intent(inout) :: self
      character(len=*), intent(in) :: value
      type(error_t), allocatable :: error
      integer :: status

      if (len(self%fault) > 0) return
      status = verify(value, "0123456789")
      if (status == 0) read(value, *, iostat=status) self%options%n_thread
      if (status == 0) call threads_check(self%options%n_thread, error)
      if (allocated(error)) then
         self%fault = "--threads: " // error%message
      else if (status /= 0) then
         self%fault = "--threads takes a number, not '" // value // "'"
      end if
   end subroutine take_threads

   subroutine near_option(name, near)
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: near
      type(string_t) :: known(11)

      known(1)%text = "--output"
      known(2)%text = "--set"
      known(3)%text = "--lenient"
      known(4)%text = "--quiet"
      known(5)%text = "--help"
      known(6)%text = "--version"
      known(7)%text = "--strict"
      known(8)%text = "--json"
      known(9)%text = "--threads"
      known(10)%text = "--until"
      known(11)%text = "--steps"
      call nearest_word(name, known, near)
   end subroutine near_option

   pure subroutine without_slash(path, folder)
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: folder

      folder = path
      do while (len(folder) > 1)
         if (folder(len(folder):) /= "/") exit
         folder = folder(:len(folder) - 1)
      end do
   end subroutine without_slash

   subroutine argument(i, word)
      integer, intent(in) :: i
      character(len=:), allocatable, intent(out) :: word
      integer :: length

      call get_command_argument(i, length=length)
      allocate(character(len=length) :: word)
      call get_command_argument(i, word)
   end subroutine argument

   !> The help text.
   function usage() result(line)
      character(len=72) :: line(29)

      line = [character(len=72) :: &
         "usage: emcon [run] DECK [options]     run a deck", &
         "       emcon check DECK [options]     check and describe it, no run", &
         "       emcon restart NAME.rst.h5      continue from a restart file", &
         "       emcon keywords [NAME]          list keywords of decks", &
         "", &
         "options:", &
         "  --output DIR       write the results into DIR, not beside the deck", &
         "  --set NAME=VALUE   set a *PARAMETER of the deck; may be repeated;", &
         "                     without =VALUE: lists the parameters", &
         "  --lenient          leave out unsupported output, with warnings", &
         "  --quiet            print errors, warnings and a bad verdict only", &
         "  --strict           exit with code 3 if the verdict is bad", &
         "  --threads N        number of threads (default: OMP_NUM_THREADS, or 1);", &
         "                     results have the same bits for any number", &
         "  --until T          restart: end the last step at time T", &
         "  --steps FILE       restart: continue with the steps of FILE", &
         "                     (both need --output)", &
         "  --json             check: report as one JSON object", &
         "  --version, --help", &
         "", &
         "results:  NAME.vtkhdf fields for ParaView, NAME.csv and NAME.h5 history,", &
         "          NAME.log, NAME.json verdict, NAME.rst.h5 for a restart", &
         "exit:     0 done, 2 error in the deck or on the command line,", &
         "          3 the analysis failed (results up to there are kept), or", &
         "            bodies overlap by more than a tenth of an edge, or the", &
         "            energy balance is off by more than 1e-6,", &
         "          4 a file cannot be written, or a restart file is damaged,", &
         "          130 interrupted", &
         "decks:    docs/deck.md"]
   end function usage

end module emcon_command_line
