!> What is to be written, and when.
module emcon_requests
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   use emcon_text, only : string_t
   implicit none
   private
   public :: output_t
   public :: output_node_file, output_element_file, output_contact_file
   public :: output_node_print, output_element_print, output_contact_print, output_energy_print, &
      output_section_print

   integer, parameter :: output_node_file = 1, output_element_file = 2, output_contact_file = 3, &
      output_node_print = 4, output_element_print = 5, output_contact_print = 6, &
      output_energy_print = 7, output_section_print = 8

   !> One output request.
   type :: output_t
      type(origin_t) :: origin
      integer :: kind = 0                            !! one of `output_`
      type(string_t), allocatable :: variable(:)     !! "U", "S", ... upper case, short Abaqus forms
      integer :: set = 0                             !! node or element set; 0: all; or surface
      character(len=:), allocatable :: name          !! of a section
      integer :: frequency = 1                       !! every so many increments, 0: never
      real(wp), allocatable :: time(:)               !! TIME POINTS, ascending; none: by frequency
      logical :: totals = .false.                    !! TOTALS=YES or ONLY
      logical :: only_totals = .false.
      logical :: is_local = .false.                  !! vectors in the axes of their nodes
   end type output_t

end module emcon_requests
