!> The scene: all that a deck says, as plain data. Nothing here computes.
!>
!> Nodes, elements and so on are numbered 1..n in the order of the deck; the user's numbers are
!> kept as labels. Units are the user's own, consistent: length [L], mass [M], time [T].
module emcon_scene
   use emcon_amplitudes, only : amplitude_t
   use emcon_couplings, only : equation_t, tie_t
   use emcon_element_kind, only : element_kind_t
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_materials, only : material_t, section_t
   use emcon_mesh, only : named_set_t, surface_t
   use emcon_origin, only : origin_t
   use emcon_rigid_bodies, only : rigid_body_t
   use emcon_steps, only : step_t
   use emcon_text, only : string_t, to_text
   use emcon_turned_axes, only : turned_axes_t
   implicit none
   private
   public :: scene_t, scene_nodes_t, scene_elements_t, scene_sets_t, scene_host_t, scene_deck_t
   public :: scene_of_nodes, where_text

   !> The text that the scene was read from.
   type :: scene_deck_t
      type(string_t), allocatable :: file(:)         !! names of the deck files
      integer :: n_own_file = huge(1)                !! those behind hold further steps of a run
      character(len=:), allocatable :: heading
      character(len=:), allocatable :: idle          !! cards that change nothing, and why
      character(len=:), allocatable :: labels        !! of instances
      !> Why surfaces of contact keep their mass, "": they lose it; not allocated: the steps say so.
      character(len=:), allocatable :: keeps_mass
      logical :: only_checks = .false.               !! *NO ANALYSIS
   end type scene_deck_t

   !> What the deck calls its nodes.
   type :: scene_nodes_t
      integer, allocatable :: label(:)               !! (n_node)
      type(origin_t), allocatable :: origin(:)       !! (n_node)
      type(turned_axes_t), allocatable :: turned(:)  !! those with axes of their own
   end type scene_nodes_t

   type :: scene_elements_t
      integer, allocatable :: label(:)               !! (n_element)
      type(origin_t), allocatable :: origin(:)       !! (n_element)
      type(element_kind_t), allocatable :: kinds(:)  !! known to the deck
      integer, allocatable :: kind(:)                !! (n_element) index into `kinds`
      integer, allocatable :: node(:, :)             !! (n_most, n_element) behind the last one, or
                                                     !! where it is wrong, 0
      integer, allocatable :: section(:)             !! (n_element)
   end type scene_elements_t

   type :: scene_sets_t
      type(named_set_t), allocatable :: node(:)
      type(named_set_t), allocatable :: element(:)
   end type scene_sets_t

   !> What a host code computes.
   type :: scene_host_t
      logical :: is_whole = .false.                  !! all nodes are its: it computes the solids
      type(origin_t) :: origin
      integer, allocatable :: node(:)                !! ascending: what these do comes from outside
   end type scene_host_t

   type :: scene_t
      type(scene_deck_t) :: deck
      integer :: n_dim = 2
      logical :: is_axial = .false.                  !! solids of revolution: x is the radius
      type(scene_nodes_t) :: node
      real(wp), allocatable :: x(:, :)               !! (n_dim, n_node) reference positions [L]
      type(scene_elements_t) :: element
      type(scene_sets_t) :: set
      type(surface_t), allocatable :: surface(:)
      type(material_t), allocatable :: material(:)
      type(section_t), allocatable :: section(:)
      type(amplitude_t), allocatable :: amplitude(:)
      type(contact_pair_t), allocatable :: pair(:)
      type(contact_pair_t), allocatable :: guard(:)  !! of the pairs: emcon_guards
      type(tie_t), allocatable :: tie(:)
      type(equation_t), allocatable :: equation(:)
      type(rigid_body_t), allocatable :: rigid(:)
      type(scene_host_t) :: host
      real(wp), allocatable :: u0(:, :)              !! (n_dim, n_node) initial displacement [L]
      real(wp), allocatable :: v0(:, :)              !! (n_dim, n_node) initial velocity [L/T]
      type(step_t), allocatable :: step(:)
   end type scene_t

contains

   !> Nodes with the labels 1 and on, one step, and nothing else.
   pure subroutine scene_of_nodes(scene, x)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: x(:, :)                !! (n_dim, n_node) reference positions [L]
      integer :: i

      scene%n_dim = size(x, 1)
      scene%deck%heading = ""
      allocate(scene%x, source=x)
      allocate(scene%u0(size(x, 1), size(x, 2)), scene%v0(size(x, 1), size(x, 2)), source=0.0_wp)
      allocate(scene%node%label, source=[(i, i = 1, size(x, 2))])
      allocate(scene%deck%file(0), scene%node%origin(size(x, 2)), scene%element%origin(0))
      allocate(scene%element%label(0), scene%element%kind(0), scene%element%section(0))
      allocate(scene%element%node(size(x, 1), 0), scene%element%kinds(0))     ! room for a facet
      allocate(scene%set%node(0), scene%set%element(0), scene%surface(0), scene%amplitude(0))
      allocate(scene%material(0), scene%section(0), scene%pair(0), scene%tie(0))
      allocate(scene%equation(0), scene%rigid(0), scene%step(1), scene%node%turned(0))
      allocate(scene%step(1)%prescribed(0), scene%step(1)%turn(0), scene%step(1)%load(0), &
         scene%step(1)%output(0))
   end subroutine scene_of_nodes

   !> "file:line" of `origin`, for messages.
   pure function where_text(scene, origin) result(text)
      type(scene_t), intent(in) :: scene
      type(origin_t), intent(in) :: origin
      character(len=where_length(scene, origin)) :: text

      text = "(no deck)"
      if (origin%file > 0) text = scene%deck%file(origin%file)%text // ":" // to_text(origin%line)
   end function where_text

   pure integer function where_length(scene, origin)
      type(scene_t), intent(in) :: scene
      type(origin_t), intent(in) :: origin

      where_length = len("(no deck)")
      if (origin%file > 0) where_length = len(scene%deck%file(origin%file)%text) + 1 &
         + len(to_text(origin%line))
   end function where_length

end module emcon_scene
