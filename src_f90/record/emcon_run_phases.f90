!> Where the CPU time of a run went, as a table for its log and as members of its JSON object.
module emcon_run_phases
   use emcon_json, only : json_number
   use emcon_kinds, only : dp, wp
   use emcon_phases, only : n_phase, phase_assemble, phase_factorise, phase_gaps, phase_name, &
      phase_residual, phase_search, phase_solve, phases_seconds, phases_t
   use emcon_text, only : note_add, notes_t, to_text
   use emcon_timer, only : cpu_seconds
   implicit none
   private
   public :: run_parts_t, run_parts_mark, run_phases_lines, run_phases_json

   !> Parts of a run: what comes before the first increment, the increments, the files.
   integer, parameter, public :: part_read = 1, part_march = 2, part_output = 3

   type :: run_parts_t
      real(dp) :: seconds(3) = 0.0_dp            !! CPU time of each part [s]
      real(dp) :: marked = 0.0_dp                !! CPU time of the process so far [s]
   end type run_parts_t

contains

   !> What was spent since the last mark belongs to `part`.
   subroutine run_parts_mark(self, part)
      type(run_parts_t), intent(inout) :: self
      integer, intent(in) :: part                !! one of the `part_` codes
      real(dp) :: before

      before = self%marked
      self%marked = cpu_seconds()
      self%seconds(part) = self%seconds(part) + (self%marked - before)
   end subroutine run_parts_mark

   !> The table, a line each phase.
   subroutine run_phases_lines(parts, phases, lines)
      type(run_parts_t), intent(in) :: parts
      type(phases_t), intent(in) :: phases
      type(notes_t), intent(out) :: lines
      real(dp) :: seconds(n_phase), total
      integer :: k

      total = max(sum(parts%seconds), tiny(total))
      seconds = phases_seconds(phases, parts%seconds(part_march))
      call note_add(lines, "phase          CPU [s]       %")
      call add("read", parts%seconds(part_read), "")
      do k = 1, n_phase
         call add(phase_name(k), seconds(k), counts_text(phases, k))
      end do
      call add("output", parts%seconds(part_output), "")
      call add("all", total, "")

   contains

      subroutine add(name, spent, counts)
         character(len=*), intent(in) :: name, counts
         real(dp), intent(in) :: spent           !! [s]
         character(len=len(phase_name)) :: first
         character(len=80) :: line

         first = name
         write(line, "(a, f11.3, f8.1, 2x, a)") first, spent, 100.0_dp*spent/total, counts
         call note_add(lines, trim(line))
      end subroutine add

   end subroutine run_phases_lines

   !> What phase `k` has done.
   pure function counts_text(phases, k) result(text)
      type(phases_t), intent(in) :: phases
      integer, intent(in) :: k
      character(len=40) :: text

      select case (k)
      case (phase_search)
         text = to_text(phases%n_searched) // " times a pair"
      case (phase_gaps)
         text = to_text(phases%n_measured) // " times a pair"
      case (phase_residual)
         text = to_text(phases%n_residual) // " residuals"
      case (phase_assemble)
         text = to_text(phases%n_tangent) // " residuals with tangent"
      case (phase_factorise)
         text = to_text(phases%n_factorisation) // " factorisations"
      case (phase_solve)
         text = to_text(phases%n_solve) // " solutions"
      case default
         text = ""
      end select
   end function counts_text

   !> Members `seconds` and `counts` of a JSON object, to be appended to others.
   subroutine run_phases_json(parts, phases, members)
      type(run_parts_t), intent(in) :: parts
      type(phases_t), intent(in) :: phases
      character(len=:), allocatable, intent(out) :: members
      character(len=:), allocatable :: object
      real(dp) :: seconds(n_phase)
      integer :: k

      seconds = phases_seconds(phases, parts%seconds(part_march))
      object = "{"
      call json_number(object, "read", real(parts%seconds(part_read), wp))
      do k = 1, n_phase
         call json_number(object, trim(phase_name(k)), real(seconds(k), wp))
      end do
      call json_number(object, "output", real(parts%seconds(part_output), wp))
      members = '"seconds": ' // object // '}, "counts": '
      object = "{"
      call json_number(object, "searched", real(phases%n_searched, wp))
      call json_number(object, "measured", real(phases%n_measured, wp))
      call json_number(object, "residuals", real(phases%n_residual, wp))
      call json_number(object, "tangents", real(phases%n_tangent, wp))
      call json_number(object, "factorisations", real(phases%n_factorisation, wp))
      call json_number(object, "solutions", real(phases%n_solve, wp))
      members = members // object // "}"
   end subroutine run_phases_json

end module emcon_run_phases
